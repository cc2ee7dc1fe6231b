"use strict";
// The thesis' comparison, a step a configuration.

const TOUR = [
  {
    title: "PID alone",
    law: "pid", feedforward: "none",
    text: "Where an axis reverses, friction changes its sign, and the integral needs time to follow. The axis sticks for a moment: the quadrant glitch.",
    look: "the spikes at 0°, 90°, 180° and 270° of the circle, and those of the tracking error, one at each reversal.",
  },
  {
    title: "Static feedforward",
    law: "pid", feedforward: "static",
    text: "The Stribeck curve, fed forward with the sign of the velocity. It knows sliding, but not the first micrometres after a reversal, where friction rises like a spring.",
    look: "the friction at the reversal: the feedforward jumps, the stage's friction does not. The error changes its shape, and sign.",
  },
  {
    title: "GMS feedforward",
    law: "pid", feedforward: "gms",
    text: "The generalized Maxwell-slip model: blocks on springs that slip one after the other. It knows pre-sliding, but slides on at the breakaway level.",
    look: "the friction at the reversal: now both bend alike. On the whole stroke a part is missing: what depends on the velocity.",
  },
  {
    title: "Static and GMS",
    law: "pid", feedforward: "combined",
    text: "The blocks slide on the Stribeck curve, and viscous friction is added: each effect once.",
    look: "the two friction curves, which now lie on each other, and the circle. What is left is noise, the screw's ripple, and what identification missed.",
  },
  {
    title: "N-PID alone",
    law: "n-pid", feedforward: "none",
    text: "Without a model of friction: a PID whose gain grows with the error, so that it pulls harder in a glitch. Its gain is held to what the loop allows.",
    look: "the spikes: lower than with PID, in the same places, and with a small oscillation on their tops, where the gain is highest. The open loop is that of small errors, and the same.",
  },
  {
    title: "N-PID, static and GMS",
    law: "n-pid", feedforward: "combined",
    text: "The whole law. The feedforward takes the friction that is known, the nonlinear gain what is not. Now turn the friction of the stage: the law does not know of it.",
    look: "how much the error grows when the friction doubles, with this law and with step 4; then set the law's friction.",
  },
];
