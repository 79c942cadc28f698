"""Sections of the stock procedures, their stages, and the turners that have none of an arm's joints."""
