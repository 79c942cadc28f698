"""The KVH 1775 inertial measurement unit on its own serial port; "ICD" is its maker's document 56-0298 Rev. B."""
