"""Flags for a DQN that learns quickly."""

SMALL = [
    *("--dqn.layers", "2", "--dqn.width", "8", "--dqn.rows", "3", "--dqn.columns", "4"),
    *("--dqn.learning-starts", "64", "--dqn.batch", "64", "--dqn.first-steps", "4", "--dqn.steps", "2"),
]
