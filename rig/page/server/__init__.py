"""The server of a page: its addresses, connections, the stream of what is shown, and who may speak to it."""
