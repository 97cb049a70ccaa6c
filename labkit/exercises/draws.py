"""Draws of arguments made from other draws."""


def scaled(rng, draw, factors):
    """The arguments of a draw, each multiplied by its factor: who clips what is large, or drops what is small, is right
    within the common range alone.

    Parameters
    ----------
    rng : numpy.random.Generator
    draw : function
        draw(rng) -> tuple of numbers and arrays.
    factors : tuple of float
        One for each argument; 1 leaves it as it is.

    Returns
    -------
    arguments : tuple
    """
    return tuple(argument if factor == 1 else factor * argument for argument, factor in zip(draw(rng), factors))
