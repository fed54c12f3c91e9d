"""What the programs about proofs share: drawn motions, an oracle by Pinocchio and Coal, and other methods beside the proof."""
