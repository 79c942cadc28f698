"""Headers and pages that are made from the tables of messages and parts."""
