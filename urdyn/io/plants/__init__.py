"""What plants listen to: Prometheus and MQTT, off, and on the loopback, by default."""
