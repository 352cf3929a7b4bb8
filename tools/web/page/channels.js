// Which quantities of which devices are drawn, and how that is written into the page's address:
// #charts/axis1.value,gm1.power_w.

const HUES = 8;
const FIRST_SHOWN = 4;

export function channelOf(machine, key) {
  const dot = key.lastIndexOf(".");
  const device = machine.devices.get(key.slice(0, dot));
  const index = device?.columns.findIndex((column) => column.name === key.slice(dot + 1)) ?? -1;
  if (index < 0) return null;
  const column = device.columns[index];
  const place = [...machine.devices.keys()].indexOf(device.device);
  return { key, device: device.device, column: column.name, unit: column.unit, colour: (place + 3 * index) % HUES };
}

export function channelsOf(machine, device) {
  return (machine.devices.get(device)?.columns ?? []).map((column) => channelOf(machine, `${device}.${column.name}`));
}

// What a newcomer sees: the first encoder's value and speed, a second one's value, and a motor's power.
export function firstChannels(machine) {
  const devices = [...machine.devices.values()];
  const encoders = devices.filter((device) => device.kind === "position");
  const motor = devices.find((device) => device.kind === "motor");
  const keys = [];
  if (encoders[0]) keys.push(`${encoders[0].device}.value`, `${encoders[0].device}.speed_rpm`);
  if (encoders.length > 2) keys.push(`${encoders[2].device}.value`);
  if (motor) keys.push(`${motor.device}.power_w`);
  return keys.filter((key) => channelOf(machine, key)).slice(0, FIRST_SHOWN);
}
