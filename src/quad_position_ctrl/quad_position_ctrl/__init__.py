"""Position laws of the cascade: adaptive integral backstepping (AIBS, eqs. 18-38) and its additions."""
