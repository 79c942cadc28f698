"""An operator's hand as what turns the sensors."""
