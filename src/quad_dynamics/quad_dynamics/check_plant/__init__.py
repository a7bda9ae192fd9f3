"""Tests any plant or hardware bridge against the contract of docs/how_to/swap_the_plant.md."""
