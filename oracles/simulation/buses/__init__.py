"""Simulated buses below the real driver's transports: any Target behind an sg node or a USB bridge."""
