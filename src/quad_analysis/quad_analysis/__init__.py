"""What a recorded flight tells: metrics, verdict, replay of its laws, other laws in shadow, the model's horizon."""
