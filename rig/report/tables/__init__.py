"""The numbers of a result as terminal, certificate and digital certificate state them."""
