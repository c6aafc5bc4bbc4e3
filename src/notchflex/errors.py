"""What the package raises for input that cannot be used."""


class InputError(ValueError):
    """An input is outside what is allowed.

    The message is one sentence, or one per problem: what was got, what is allowed, what to do.
    The command line prints it as it is and exits with code 2.
    """


class RobotFileError(InputError):
    """A robot file, or the name of a ready robot, cannot be used; the message names it."""
