"""The closed form: turning points, period, angles and everything that follows from them."""
