/// Drive states in words (CiA 402, docs/drives.md), from the statusword, object 6041.

/** State of the drive's state machine. */
export function driveState(statusword: number): string {
  const masked = statusword & 0x6f;
  if ((statusword & 0x4f) === 0x00) return "not ready to switch on";
  if ((statusword & 0x4f) === 0x40) return "switch on disabled";
  if (masked === 0x21) return "ready to switch on";
  if (masked === 0x23) return "switched on";
  if (masked === 0x27) return "operation enabled";
  if (masked === 0x07) return "quick stop active";
  if ((statusword & 0x4f) === 0x0f) return "fault reaction active";
  if ((statusword & 0x4f) === 0x08) return "fault";
  return "unknown";
}

/** What else the statusword says. */
export function driveRemarks(statusword: number): string[] {
  const remarks: string[] = [];
  if (statusword & 0x80) remarks.push("warning");
  if (statusword & 0x800) remarks.push("internal limit active");
  return remarks;
}
