"""How much room a stance leaves: regions of balance, margins in motion, and pushes it can take."""
