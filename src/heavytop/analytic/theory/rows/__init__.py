"""The closed form of one period, for whole arrays of tops: a row of numbers for each.

`start` reduces each motion with twice the digits of a double, `roots` finds its turning points,
`integrals` its elliptic integrals, and `row` puts the period and what turns in it together. A row
depends on its own top and start alone, bit for bit; which rows do not have their digits is told.
"""
