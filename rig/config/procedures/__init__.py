"""Sections of the stock procedures, their stages, and of turners without an arm's joints."""
