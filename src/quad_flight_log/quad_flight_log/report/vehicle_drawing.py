"""How a vehicle is drawn: the same shape and arrow lengths in every viewer."""

ARM = 0.9  # m from the centre to a rotor: three times Table 1, to be seen from afar
ROTORS = ((-ARM, 0.0, 0.0), (0.0, -ARM, 0.0), (ARM, 0.0, 0.0), (0.0, ARM, 0.0))  # rear, right, front, left (FLU)
THRUST_SCALE = 0.4  # m of arrow per N
DISTURBANCE_SCALE = 5.0  # m of arrow per N


def rgb(colour: str) -> tuple[int, int, int]:
    """Return the red, green and blue (0 to 255) of ``#rrggbb``."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
