"""SCSI devices of any kind: commands, sense data, and the transports to them."""
