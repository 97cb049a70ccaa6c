"""What Jupyter's server does differently where labkit is installed; `etc/jupyter/` of the environment loads this.

Pictures leave at once (`connection`), and a notebook that was looked at stays as it is (`saving`). A server
that was told to use another connection keeps it. What it has loaded so far stays, and Python no longer looks through it
for garbage, which takes 40 ms and would come before some picture.
"""

import gc

from jupyter_server.services.kernels.connection.channels import ZMQChannelsWebsocketConnection

from .connection import PromptConnection
from .saving import keep_language

CONNECTION = "kernel_websocket_connection_class"


def _load_jupyter_server_extension(serverapp):
    """Called by Jupyter's server as it starts."""
    settings = serverapp.web_app.settings
    if settings.get(CONNECTION) is ZMQChannelsWebsocketConnection:
        settings[CONNECTION] = PromptConnection
    serverapp.contents_manager.register_pre_save_hook(keep_language)
    gc.freeze()


def _jupyter_server_extension_points():
    return [{"module": "labkit.server"}]
