"""What is installed for tables, pages and clusters only is nothing to the node: it answers where none of it is."""

import json
import subprocess
import sys

from ctr_pvs_ros.process import isolate
from ctr_pvs_ros.process import share_file

EXTRAS = ("dask", "distributed", "pyarrow", "viser")
#: None in sys.modules makes an import fail, and stays what it is where nobody tries.
PROGRAM = """
import json
import sys
import rclpy
extras, robot = json.loads(sys.argv[1]), sys.argv[2]
sys.modules.update(dict.fromkeys(extras))
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from ctr_pvs_ros import executable
from ctr_pvs_ros.node import EquilibriumNode
rclpy.init(args=[])
node = EquilibriumNode(namespace="/bare", parameter_overrides=[Parameter("robot_file", value=robot)])
(commands,) = (each for each in node.subscriptions if each.topic_name == "/bare/servo_jp")
names = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
commands.callback(JointState(name=names, position=[0.0, 0.0935, 0.5, 0.2085]))
status = node.handler.report.status("node", "robot", 0.0)
print(json.dumps({value.key: value.value for value in status.values}))
loaded = {name.partition(".")[0] for name, module in sys.modules.items() if module is not None}
print(json.dumps(sorted(loaded & set(extras))))
node.destroy_node()
rclpy.shutdown()
"""


def test_the_node_answers_without_them():
    isolate()
    words = [sys.executable, "-c", PROGRAM, json.dumps(EXTRAS), str(share_file("config", "renda2021.yaml"))]
    process = subprocess.run(words, capture_output=True, text=True, timeout=120.0, check=False)
    assert process.returncode == 0, process.stderr
    values, loaded = map(json.loads, process.stdout.splitlines()[-2:])
    assert values["answers published"] == "1" and loaded == []
