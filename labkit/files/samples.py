"""The three synthetic cells of `data/own_data`, each with one planted fault, as their owners would have saved them."""

from ..tables import DATA

FILES = {
    "swapped_role": ("robot.csv", "sensor.txt"),
    "slipped_screw": ("robot.csv", "sensor.csv"),
    "late_clock": ("robot.txt", "tracker.txt"),
}


def sample_cell(name):
    """Paths of the two files of a cell: the robot's, and the sensor's or tracker's.

    Parameters
    ----------
    name : str
        "swapped_role", "slipped_screw" or "late_clock".

    Returns
    -------
    robot, sensor : Path

    Raises
    ------
    ValueError
        For another name.
    """
    if name not in FILES:
        raise ValueError(f"the cell must be one of {', '.join(FILES)}, got {name!r}")
    return tuple(DATA / "own_data" / name / file for file in FILES[name])
