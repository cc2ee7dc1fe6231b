"""Moves an axis of a machine and records it; the outputs are off when the block is left, whatever happens."""

import sys

import quadrant as q

with q.Machine(sys.argv[1] if len(sys.argv) > 1 else "simulated:commissioned") as machine:
    print(machine.endpoint, machine.identity)
    machine.enable()
    try:
        machine.run({"x": q.Motion.sine(5.0, 20.0, cycles=1.0)})
        frame = machine.record(["x.error", "x.position", "x.output"], 2.0)
        machine.wait()
    except q.Fault as fault:
        sys.exit(f"{fault.cause}; {fault.remedy}")
print(frame.describe())
