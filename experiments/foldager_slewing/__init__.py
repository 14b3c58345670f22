"""The link slewed by its motor, and what motor and controller do to its vibration."""
