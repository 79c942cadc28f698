"""Headers and pages generated from the tables of messages and parts."""
