"""What has to be solved at one command: sections, the materials in them, and the fields of a shape along the robot.

May use ``errors`` and ``robot``, and numpy; no scipy."""
