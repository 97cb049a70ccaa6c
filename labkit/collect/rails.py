"""What a submitted notebook may not do, refused inside Python itself by an audit hook.

With bubblewrap this is the second wall, without it the only one: it holds against calls of Python's own functions, not
against code that brings its own way to the operating system.
"""

import os
import sys
import weakref

WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
NEVER = (
    "subprocess.", "ctypes.", "gc.get_", "socket.getaddrinfo", "socket.gethostby", "socket.connect",
    "os.system", "os.exec", "os.fork", "os.posix_spawn", "os.spawn", "os.kill", "os.startfile", "os.link", "os.symlink",
    "os.chmod", "os.chown", "os.setxattr", "os.removexattr", "pty.", "signal.pthread_kill", "resource.setrlimit",
    "resource.prlimit", "syslog.", "webbrowser.", "winreg.", "fcntl.", "mmap.",
    "shutil.make_archive", "sys._current_frames",
)  # fmt: skip
MOVES = ("os.remove", "os.rename", "os.rmdir", "os.mkdir", "os.truncate", "os.utime", "shutil.")
LOOKS = ("os.listdir", "os.scandir", "glob.")
HERE = ("127.0.0.1", "localhost")
FOREIGN = ("cffi", "_cffi_backend", "multiprocessing", "concurrent.futures.process")
PLACES = (
    "/dev/null", "/dev/urandom", "/dev/zero", "/proc/self/", "/proc/meminfo", "/proc/cpuinfo", "/proc/stat", "/usr/",
    "/lib", "/etc/fonts", "/etc/localtime", "/etc/mime.types", "/sys/devices/system/cpu", "/System/", "/Library/",
    "/opt/homebrew/",
)  # fmt: skip


def lay(readable, secret, own):
    """From here on this process reads `readable` folders but not the `secret` files, and writes in its `own` folder.

    There is no way back: an audit hook cannot be taken away.
    """
    rails, rules = Rails(readable, secret, own), {}

    def hook(event, args):
        if event not in rules:
            rules[event] = rails.rule(event)
        if rules[event] is not None:
            rules[event](event, args)

    sys.addaudithook(hook)


def refuse(event, args=()):
    what = args[0] if args and isinstance(args[0], str | bytes) else ""
    raise PermissionError(f"a submitted notebook may not do this here: {event} {what}".strip())


def is_path(value):
    return isinstance(value, str | bytes | os.PathLike)


class Rails:
    """What is allowed, event by event."""

    def __init__(self, readable, secret, own):
        self.own = os.path.realpath(own) + os.sep
        self.readable = tuple(os.path.realpath(place) + os.sep for place in readable)
        self.secret = tuple(os.path.realpath(place) + os.sep for place in secret)
        self.sockets = weakref.WeakSet()

    def rule(self, event):
        """What is called at an event; None where everything is allowed."""
        if event.startswith(NEVER):
            return refuse
        rules = {"open": self.opened, "import": self.imported, "object.__setattr__": self.replaced}
        families = ((("socket.",), self.connected), (MOVES, self.moved), (LOOKS, self.looked))
        return rules.get(event) or next((rule for names, rule in families if event.startswith(names)), None)

    def may_read(self, path):
        where = os.path.realpath(path)
        folder = where + os.sep
        if folder.startswith(self.secret):  # also where the checkout lies in /tmp, the own folder under bubblewrap
            return False
        return folder.startswith((self.own, *self.readable)) or where.startswith(PLACES)

    def may_write(self, path):
        return f"{os.path.realpath(path)}{os.sep}".startswith((self.own, os.devnull))

    def opened(self, event, args):
        path, mode, flags = args
        if is_path(path):
            by_mode = isinstance(mode, str) and any(letter in mode for letter in "wax+")
            writes = by_mode if isinstance(mode, str) else bool((flags or 0) & WRITES)
            if not (self.may_write if writes else self.may_read)(os.fsdecode(path)):
                refuse("write" if writes else "read", (path,))

    def connected(self, event, args):
        """A server on this machine's own address, and datagrams to it: chapter 6 sends itself its packets."""
        if event == "socket.bind":
            if args[1][0] not in HERE:
                refuse(event)
            self.sockets.add(args[0])
        elif event in ("socket.sendto", "socket.sendmsg"):
            ports = [socket.getsockname()[1] for socket in list(self.sockets) if socket.fileno() >= 0]
            if not args[1] or args[1][0] not in HERE or args[1][1] not in ports:
                refuse(event)

    def imported(self, event, args):
        if args[0] in FOREIGN:
            refuse(event, args)

    def replaced(self, event, args):
        if getattr(args[0], "__module__", "") == __name__:
            refuse(event)

    def moved(self, event, args):
        if any(is_path(path) and not self.may_write(os.fsdecode(path)) for path in args):
            refuse(event, args)

    def looked(self, event, args):
        if args and is_path(args[0]) and not self.may_read(os.fsdecode(args[0]) or "."):
            refuse(event, args)
