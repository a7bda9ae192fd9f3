"""Tests any plant or hardware bridge against the contract of docs/swap_the_plant.md."""
