"""What plants listen to: Prometheus and MQTT, off unless asked for, loopback unless told."""
