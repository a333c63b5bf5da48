"""What can go wrong with the robot, as a program that builds sees it."""


class RobotError(RuntimeError):
    """The robot does not answer; the message says which part."""
