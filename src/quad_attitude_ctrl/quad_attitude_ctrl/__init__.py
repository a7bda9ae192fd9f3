"""Attitude laws of the cascade: ABFNITSM (eqs. 39-60), its command filter and its additions."""
