"""The time stamps of logs: their order, their interval, and what is missing between them."""
