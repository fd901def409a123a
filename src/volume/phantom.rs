//! Built-in volumes: formulas sampled at any size.
