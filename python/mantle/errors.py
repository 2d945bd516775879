"""What Mantle raises, as the exit statuses of the program: 1 Fault, 2 BadInput, 3 CannotGoOn."""


class Error(Exception):
    """Every error of Mantle; its text is one line that names what, where, value and bound."""


class BadInput(Error, ValueError):
    """A scene, option, file or argument that cannot be. Nothing was changed. Exit status 2."""


class CannotGoOn(Error, RuntimeError):
    """A run that could not go on, or whose end a user has to know of. Exit status 3.

    `results` are the partial results (mantle.Results), where there are any, else None.
    """

    results = None


class Fault(Error, RuntimeError):
    """An internal fault, or a part of Mantle that is missing. Exit status 1."""


class MantleWarning(UserWarning):
    """What looks wrong with a run or scene and does not end it."""
