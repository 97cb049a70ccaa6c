"""The wheel: whole, installed outside any checkout, with its settings; and the edition for exams, without solutions."""

import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import numpy
import pytest

from labkit.exercises import source

ROOT = source.ROOT
HELD = ("labkit", "data", "notebooks", "solutions")


def built(folder, edition=""):
    """The wheel that `pip wheel .` makes of this checkout."""
    words = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(words, cwd=ROOT, env={**os.environ, "LABKIT_EDITION": edition}, check=True, capture_output=True)
    (path,) = Path(folder).glob("labkit-*.whl")
    return path


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return built(tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """A function that runs a program of an environment where the wheel is installed, in a folder elsewhere.

    All other packages are those of the environment that runs this test.
    """
    home = tmp_path_factory.mktemp("home")
    place = home / "env"
    venv.create(place, symlinks=os.name != "nt")
    scripts = place / ("Scripts" if os.name == "nt" else "bin")
    pip = [sys.executable, "-m", "pip", "--python", str(scripts / "python"), "install", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--disable-pip-version-check", str(wheel)], check=True, capture_output=True)
    own = next(place.glob("**/site-packages"))
    (own / "others.pth").write_text(str(Path(numpy.__file__).parents[1]), encoding="utf-8")

    def run(program, *words, **environment):
        kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "LABKIT_PROGRESS")}
        return subprocess.run(
            [str(scripts / program), *words],
            cwd=home,
            env={**kept, "HOME": str(home), "USERPROFILE": str(home), "PYTHONUTF8": "1", **environment},
            capture_output=True,
            encoding="utf-8",
            timeout=120,
        )

    run.home = home
    return run


def names(path, under=""):
    with zipfile.ZipFile(path) as file:
        return {name for name in file.namelist() if name.startswith(under)}


def test_the_wheel_holds_every_file_of_the_workbook(wheel):
    listed = subprocess.run(["git", "ls-files", *HELD], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("this folder is no git checkout: nothing says which files belong to it")
    files = [name for name in listed.stdout.splitlines() if (ROOT / name).exists()]
    wanted = {name if name.startswith("labkit/") else f"labkit/edition/{name}" for name in files}
    assert wanted <= names(wheel)
    assert not [name for name in names(wheel, "labkit/edition") if name not in wanted and "my-copy" in name]


def test_an_edition_for_exams_holds_no_solution_and_all_else(wheel, tmp_path):
    gone = names(wheel, "labkit/") - names(built(tmp_path, "exam"), "labkit/")
    assert gone == names(wheel, "labkit/edition/solutions/") != set()


def test_an_installed_chapter_is_solved_strictly_and_gives_its_solutions(installed):
    """The solved source of chapter 1, run by the installed package; then the solution of an exercise."""
    code = """if True:
        import runpy, sys
        from labkit import places
        from labkit.exercises import course, progress
        assert not places.IS_CHECKOUT and places.ROOT.is_relative_to(sys.prefix), places.ROOT
        runpy.run_path(places.ROOT / "solutions" / "01_frames.py")
        course("01-frames").invert.solution()
        print(progress.path())"""
    told = installed("python", "-c", code, LABKIT_STRICT="1")
    assert told.returncode == 0, told.stderr
    assert "invert: a solution\n" in told.stdout and "T[:3, :3].T" in told.stdout.partition("invert: a solution")[2]
    assert Path(told.stdout.splitlines()[-1]).is_relative_to(installed.home)


def test_the_installed_command_has_the_verbs(installed):
    told = installed("labkit", "--help")
    assert told.stdout.startswith("labkit start [FOLDER]") and told.stderr == ""
    told = installed("labkit", "tset")
    assert told.returncode == 1 and told.stderr.count("\n") == 1 and "see: labkit --help" in told.stderr


def test_jupyterlab_finds_the_settings_and_the_extension(installed):
    code = """if True:
        from jupyter_server.extension.config import ExtensionConfigManager
        from jupyter_server.services.config.manager import ConfigManager
        from jupyter_core.paths import jupyter_config_path
        manager = ExtensionConfigManager(read_config_path=jupyter_config_path())
        print(manager.get_jpserver_extensions()["labkit.server"])
        settings = ConfigManager(config_dir_name="labconfig").get("default_setting_overrides")
        print(settings["@jupyterlab/notebook-extension:tracker"])"""
    told = installed("python", "-c", code, JUPYTER_PREFER_ENV_PATH="1")
    assert told.stdout.splitlines() == ["True", "{'windowingMode': 'none'}"], told.stderr
