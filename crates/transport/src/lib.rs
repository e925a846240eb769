//! Light transport: materials, lights, and the integrators that join them.
