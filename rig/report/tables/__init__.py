"""The numbers of a result for terminal, certificate and digital certificate."""
