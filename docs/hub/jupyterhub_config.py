"""A JupyterHub for the course on one machine: a rehearsal with dummy users. See docs/hub.md for the real one."""

import asyncio
import os
from pathlib import Path

HERE = Path(__file__).resolve().parent  # the folder that was installed into
PORT = int(os.environ.get("HUB_PORT", "8000"))

c = get_config()  # noqa: F821 (JupyterHub provides it)
c.JupyterHub.bind_url = f"http://127.0.0.1:{PORT}"
c.JupyterHub.hub_port, c.ConfigurableHTTPProxy.api_url = PORT + 1, f"http://127.0.0.1:{PORT + 2}"
c.ConfigurableHTTPProxy.command = [str(HERE / "node_modules" / ".bin" / "configurable-http-proxy")]
c.JupyterHub.authenticator_class = "dummy"  # any name, one password: for a rehearsal alone
c.DummyAuthenticator.password = os.environ["HUB_PASSWORD"]
c.Authenticator.allow_all = True
c.JupyterHub.spawner_class = "simple"  # every server as a process of this user, each with a home of its own
c.SimpleLocalProcessSpawner.home_dir_template = str(HERE / "homes" / "{username}")
c.Spawner.cmd = [str(HERE / "bin" / "jupyterhub-singleuser"), *(["--allow-root"] if os.geteuid() == 0 else [])]
c.Spawner.default_url = "/lab/tree/workbook/00_start_here.ipynb"
c.Spawner.environment = {"OMP_NUM_THREADS": "1", "JUPYTER_PREFER_ENV_PATH": "1"}
c.Spawner.start_timeout = c.Spawner.http_timeout = 120  # a whole class that begins at once makes each other wait
cull = [str(HERE / "bin" / "python"), "-m", "jupyterhub_idle_culler", "--timeout=3600"]
c.JupyterHub.services = [{"name": "cull", "command": cull}]
scopes = ["list:users", "read:users:activity", "read:servers", "delete:servers"]
c.JupyterHub.load_roles = [{"name": "cull", "scopes": scopes, "services": ["cull"]}]


async def lay_out(spawner):
    """Before every start: the notebooks of this edition; no cell a student wrote in is touched."""
    workbook = HERE / "homes" / spawner.user.name / "workbook"
    update = await asyncio.create_subprocess_exec(str(HERE / "bin" / "labkit"), "update", str(workbook))
    await update.wait()


c.Spawner.pre_spawn_hook = lay_out
