"""The files of a plant: tables and settings that people write, and what is made from them."""
