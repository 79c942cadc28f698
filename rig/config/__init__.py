"""YAML configuration → validated models."""
