"""The server's side of a fast Stage: pictures leave for the browser at once, without news of a busy kernel before them.

JupyterLab's server leaves Nagle's algorithm on. A picture then waits until the browser has acknowledged the short
message before it ("the kernel is busy"), and browsers put acknowledgments off: 40 ms are lost on most pictures.

And JupyterLab shows each "busy" and each "idle" anew in its toolbar and its status bar: 5 ms of the page's time and a
frame of the whole window, just when the picture comes. A widget's message that is answered at once keeps its "busy" to
itself; what takes longer, and every cell that runs, is told as ever.

`labkit.server` puts this class in the place of JupyterLab's; nothing else changes.
"""

from jupyter_server.services.kernels.connection.channels import ZMQChannelsWebsocketConnection
from tornado.ioloop import IOLoop

SHORT = 0.1  # s; what a widget is busy with for less is not told


class PromptConnection(ZMQChannelsWebsocketConnection):
    """JupyterLab's own connection between browser and kernel, with TCP_NODELAY and without short "busy" of widgets."""

    def __init__(self, **options):
        super().__init__(**options)
        self._held = {}  # a timer for each "busy" not yet told, by the id of the message the kernel is busy with

    def connect(self):
        self.websocket_handler.set_nodelay(True)
        return super().connect()

    def disconnect(self):
        while self._held:
            self._let_go(next(iter(self._held)))
        return super().disconnect()

    def handle_outgoing_message(self, stream, outgoing_msg):
        asked, state = self._status_of_widget(outgoing_msg)
        if state == "busy":
            tell = super().handle_outgoing_message
            self._held[asked] = IOLoop.current().call_later(SHORT, self._tell, asked, tell, stream, outgoing_msg)
            return
        if state == "idle":
            self._let_go(asked)  # the page learns by it that its message was dealt with
        super().handle_outgoing_message(stream, outgoing_msg)

    def _status_of_widget(self, outgoing_msg):
        """(id of a widget's message, what the kernel is now that it deals with it); both None for anything else."""
        _, (_, header, parent, _, content, *_) = self.session.feed_identities(outgoing_msg)
        if self.session.unpack(header)["msg_type"] != "status":
            return None, None
        asked = self.session.unpack(parent)
        if asked.get("msg_type") != "comm_msg":
            return None, None
        return asked["msg_id"], self.session.unpack(content)["execution_state"]

    def _tell(self, asked, tell, stream, message):
        del self._held[asked]
        tell(stream, message)

    def _let_go(self, asked):
        timer = self._held.pop(asked, None)
        if timer is not None:
            IOLoop.current().remove_timeout(timer)
