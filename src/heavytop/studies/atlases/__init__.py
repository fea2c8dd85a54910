"""The atlas: what kind of motion every pixel of a plane of tops is, and how it moves."""
