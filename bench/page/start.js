"use strict";
// One page, two views: the bench, or with ?machine=serial a machine at a serial port.

let machineView;

async function startPage() {
  if (new URLSearchParams(location.search).get("machine") !== "serial") return openBenchView();
  document.documentElement.dataset.view = "machine";
  document.title = "Quadrant: the machine";
  machineView = new MachineView(await openModule());
}

startPage();
