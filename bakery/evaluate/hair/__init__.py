"""How good hair with volume is: in its own photo, and on people whose hair is known from all sides."""
