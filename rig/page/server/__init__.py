"""The server of a page: addresses, connections, the event stream, access control."""
