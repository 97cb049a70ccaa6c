"""The server's side of a notebook that stays as it is: looking at it and saving it changes no byte.

JupyterLab writes the kernel's version into a notebook as soon as it is opened. `labkit.server` registers this hook:
what the file says of its language then stays.
"""

import json

KEPT = ("kernelspec", "language_info")


def keep_language(model, path, contents_manager, **_):
    """Before a save: the notebook's kernel and language are named as in the file, as long as they are the same."""
    if model.get("type") != "notebook" or not model.get("content"):
        return
    try:
        with open(contents_manager._get_os_path(path), encoding="utf-8") as file:
            stored = json.load(file)["metadata"]
    except (OSError, ValueError, KeyError, TypeError):
        return  # a new file, or none that can be read: nothing is to be kept
    metadata = model["content"].setdefault("metadata", {})
    for key in KEPT:
        if metadata.get(key, {}).get("name") == stored.get(key, {}).get("name") is not None:
            metadata[key] = stored[key]
