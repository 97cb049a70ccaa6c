"""The server's side of a fast Stage: pictures leave for the browser at once.

JupyterLab's server leaves Nagle's algorithm on. A picture then waits until the browser has acknowledged the short
message before it ("the kernel is busy"), and browsers put acknowledgments off: 40 ms are lost on most pictures.
`labkit.server` puts this class in its place; nothing else changes.
"""

from jupyter_server.services.kernels.connection.channels import ZMQChannelsWebsocketConnection


class PromptConnection(ZMQChannelsWebsocketConnection):
    """JupyterLab's own connection between browser and kernel, with TCP_NODELAY."""

    def connect(self):
        self.websocket_handler.set_nodelay(True)
        return super().connect()
