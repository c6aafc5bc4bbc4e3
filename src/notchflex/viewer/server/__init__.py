"""The server of the page: address, origin of requests."""
