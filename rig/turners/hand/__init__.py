"""An operator's hand as the turner."""
