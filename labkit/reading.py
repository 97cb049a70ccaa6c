"""Reading what lies in a reader's folders: what is there under a file's name may be no file.

A named pipe is silent until another program writes into it, a terminal until somebody types, and `/dev/zero` never
ends: whoever opened one of them would wait for ever.
"""

import errno
import os
import stat
from pathlib import Path


def regular(path):
    """The path, which leads to a regular file.

    Raises
    ------
    OSError
        Where it leads to nothing, or to what is no file; `strerror` says to what.
    """
    mode = os.stat(path).st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is a pipe, a socket or a device, and no file", str(path))
    return Path(path)


def is_taken(path):
    """Whether anything has this name, and be it a link that leads nowhere: then nothing new is put there."""
    return os.path.lexists(path)
