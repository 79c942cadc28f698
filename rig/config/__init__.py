"""YAML configurations, read into validated models."""
