"""What the command line does: the verb `reset` is `main(arguments)` of the module `reset`, and a line of `VERBS`."""

VERBS = {
    "start": ("[FOLDER]", "open JupyterLab; the notebooks are copied into FOLDER the first time"),
    "update": ("FOLDER", "the notebooks of this edition into FOLDER; what you wrote stays"),
    "progress": ("", "what you have solved"),
    "reset": ("NN ...", "a fresh chapter NN; your copy of it is kept beside it"),
    "calibrate": ("...", "your own poses in, a calibration with covariance, outliers and advice out"),
    "localize": ("...", "your own log in, the path with its covariance out"),
    "collect": ("...", "for lecturers: submitted notebooks in, marks and a page on the class out"),
    "demo": ("[NN ...]", "for lecturers: Stages full window, questions first; --vote lets phones answer"),
    "book": ("[NN ...]", "the reading edition: a static site whose figures still move"),
    "ledger": ("", "what the four documents print, recomputed; --strict counts results and claims alone"),
    "build": ("[NN ...]", "for authors: write the notebooks from solutions/NN_name.py; --check names the stale ones"),
}


def table(command, without=()):
    """The verbs behind a command, one line each."""
    shown = {verb: entry for verb, entry in VERBS.items() if verb not in without}
    return "\n".join(f"{f'{command} {verb} {given}':32}{does}" for verb, (given, does) in shown.items())
