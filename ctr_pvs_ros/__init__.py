"""The ROS 2 node around ctr_pvs: parameters, commands, stream, messages, report, service, node.

That is the order in which a command travels. commands, stream and report hold the decisions and know nothing of a ROS
graph; node wires them to topics.
"""
