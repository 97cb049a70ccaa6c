"""How texts write a transpose and an inverse: as the notebooks do, whichever key was at hand."""

import re


def typeset(text):
    """Text with ^T and ^-1 raised, but not in `code`.

    Parameters
    ----------
    text : str
        A sentence of an exercise: `cov C^T S^-1` outside backquotes.

    Returns
    -------
    str
        The sentence as it is shown: cov Cᵀ S⁻¹.
    """
    pieces = text.split("`")
    pieces[::2] = [re.sub(r"\^-1\b", "⁻¹", re.sub(r"\^T\b", "ᵀ", piece)) for piece in pieces[::2]]
    return "`".join(pieces)
