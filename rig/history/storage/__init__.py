"""The database of a history: engines, tables, triggers, journal."""
