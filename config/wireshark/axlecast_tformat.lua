-- Wireshark: what `axlecast log convert --to pcap` makes of the capture of a T-format bus (docs/convert.md).
--
--   wireshark -X lua_script:axlecast_tformat.lua rs485-0.pcap      or put it into Wireshark's folder of Lua plugins
--
-- LINKTYPE_USER0: our header (tools/convert/pcap.h), then the bytes. T-format by Tamagawa's "Specification of Smart Abs
-- TS5669 N127", chapter 6. Filters: axlecast.bus == "rs485-0", tformat.almc != 0, tformat.crc_bad.

local capture = Proto("axlecast", "axlecast wire capture")
local tformat = Proto("tformat", "T-format")

local kinds = {[0] = "serial", [1] = "CAN", [2] = "SPI"}
local directions = {[0] = "transmit", [1] = "receive", [2] = "stray", [3] = "silent", [4] = "link up", [5] = "link down",
                    [6] = "pulse", [7] = "retuned", [8] = "confirmed", [9] = "not sent"}

local head = {
  version = ProtoField.uint8("axlecast.version", "Version"),
  kind = ProtoField.uint8("axlecast.kind", "Kind of bus", base.DEC, kinds),
  direction = ProtoField.uint8("axlecast.direction", "Direction", base.DEC, directions),
  redacted = ProtoField.bool("axlecast.redacted", "Secrets are masked", 8, nil, 0x01),
  timeout = ProtoField.bool("axlecast.timeout", "Reply not complete in time", 8, nil, 0x02),
  line = ProtoField.bool("axlecast.line", "Character error", 8, nil, 0x04),
  id = ProtoField.int32("axlecast.id", "Device by its order in the file, or SPI clock in Hz"),
  duration = ProtoField.int32("axlecast.duration_ns", "Duration in ns"),
  bus = ProtoField.string("axlecast.bus", "Bus"),
}
capture.fields = {head.version, head.kind, head.direction, head.redacted, head.timeout, head.line, head.id,
                  head.duration, head.bus}

local field = {
  cf = ProtoField.uint8("tformat.cf", "Control field (CF)", base.HEX),
  id = ProtoField.uint8("tformat.data_id", "Data ID", base.HEX, nil, 0x78),
  sf = ProtoField.uint8("tformat.sf", "Status (SF)", base.HEX),
  single_turn = ProtoField.uint24("tformat.single_turn", "Single-turn (ABS)", base.DEC),
  multi_turn = ProtoField.uint24("tformat.multi_turn", "Multi-turn (ABM)", base.DEC),
  enid = ProtoField.uint8("tformat.enid", "Encoder ID (ENID)", base.HEX),
  almc = ProtoField.uint8("tformat.almc", "Alarms (ALMC)", base.HEX),
  over_speed = ProtoField.bool("tformat.almc.over_speed", "Over-speed (OS)", 8, nil, 0x01),
  full_absolute = ProtoField.bool("tformat.almc.full_absolute", "Full absolute status (FS)", 8, nil, 0x02),
  counting_error = ProtoField.bool("tformat.almc.counting_error", "Counting error (CE)", 8, nil, 0x04),
  overflow = ProtoField.bool("tformat.almc.overflow", "Counter overflow (OF)", 8, nil, 0x08),
  multi_turn_error = ProtoField.bool("tformat.almc.multi_turn_error", "Multi-turn error (ME)", 8, nil, 0x20),
  battery_error = ProtoField.bool("tformat.almc.battery_error", "Battery error (BE)", 8, nil, 0x40),
  battery_alarm = ProtoField.bool("tformat.almc.battery_alarm", "Battery alarm (BA)", 8, nil, 0x80),
  busy = ProtoField.bool("tformat.busy", "EEPROM busy", 8, nil, 0x80),
  address = ProtoField.uint8("tformat.address", "EEPROM address (ADF)", base.DEC, nil, 0x7F),
  data = ProtoField.uint8("tformat.eeprom", "EEPROM data (EDF)", base.HEX),
  crc = ProtoField.uint8("tformat.crc", "CRC", base.HEX),
  crc_bad = ProtoField.bool("tformat.crc_bad", "CRC is wrong"),
}
tformat.fields = {}
for _, one in pairs(field) do table.insert(tformat.fields, one) end
local alarm_bits = {field.over_speed, field.full_absolute, field.counting_error, field.overflow,
                    field.multi_turn_error, field.battery_error, field.battery_alarm}

local wrong_crc = ProtoExpert.new("tformat.crc.wrong", "The CRC is wrong", expert.group.CHECKSUM, expert.severity.ERROR)
local wrong_size = ProtoExpert.new("tformat.size.wrong", "No frame of T-format", expert.group.MALFORMED,
                                   expert.severity.WARN)
tformat.experts = {wrong_crc, wrong_size}

-- Control fields: the data ID's name, the parts of its request and of its reply (section 6.2).
local plain = {"cf"}
local position = {"cf", "sf", "single_turn", "crc"}
local read = {"cf", "adf", "crc"}
local cell = {"cf", "adf", "data", "crc"}
local ids = {
  [0x02] = {"ID 0 single-turn", plain, position},
  [0x8A] = {"ID 1 multi-turn", plain, {"cf", "sf", "multi_turn", "crc"}},
  [0x92] = {"ID 2 encoder ID", plain, {"cf", "sf", "enid", "crc"}},
  [0x1A] = {"ID 3 all", plain, {"cf", "sf", "single_turn", "enid", "multi_turn", "almc", "crc"}},
  [0x32] = {"ID 6 EEPROM write", cell, cell},
  [0xBA] = {"ID 7 clear errors", plain, position},
  [0xC2] = {"ID 8 zero single-turn", plain, position},
  [0x62] = {"ID C reset turns and errors", plain, position},
  [0xEA] = {"ID D EEPROM read", read, cell},
}
local sizes = {single_turn = 3, multi_turn = 3}

local function size_of(parts)
  local size = 0
  for _, part in ipairs(parts) do size = size + (sizes[part] or 1) end
  return size
end

-- X^8 + 1 over whole bytes (6.3.4): all bytes of a right frame cancel each other.
local function crc_is_wrong(bytes)
  local sum = 0
  for i = 0, bytes:len() - 1 do sum = bit.bxor(sum, bytes(i, 1):uint()) end
  return sum ~= 0
end

local add = {
  cf = function(tree, part)
    tree:add(field.cf, part)
    tree:add(field.id, part)
  end,
  adf = function(tree, part)
    tree:add(field.busy, part)
    tree:add(field.address, part)
  end,
  single_turn = function(tree, part, texts)
    tree:add_le(field.single_turn, part)
    table.insert(texts, "single-turn " .. part:le_uint())
  end,
  multi_turn = function(tree, part, texts)
    tree:add_le(field.multi_turn, part)
    table.insert(texts, "turns " .. part:le_uint())
  end,
  almc = function(tree, part, texts)
    local alarms = tree:add(field.almc, part)
    for _, one in ipairs(alarm_bits) do alarms:add(one, part) end
    if part:uint() ~= 0 then table.insert(texts, string.format("alarms 0x%02x", part:uint())) end
  end,
}

function tformat.dissector(bytes, pinfo, root)
  local tree = root:add(tformat, bytes())
  local is_reply = pinfo.private["axlecast_direction"] == "1"
  local id = ids[bytes(0, 1):uint()]
  local parts = id and id[is_reply and 3 or 2]
  if not parts or size_of(parts) ~= bytes:len() then
    tree:add_proto_expert_info(wrong_size)
    pinfo.cols.info:append(" no frame of T-format")
    return
  end
  local texts = {}
  local at = 0
  for _, part in ipairs(parts) do
    local range = bytes(at, sizes[part] or 1)
    if add[part] then add[part](tree, range, texts) else tree:add(field[part], range) end
    at = at + range:len()
  end
  if #parts > 1 then
    local wrong = crc_is_wrong(bytes)
    tree:add(field.crc_bad, bytes(at - 1, 1), wrong):set_generated()
    if wrong then tree:add_proto_expert_info(wrong_crc) end
  end
  pinfo.cols.protocol = "T-format"
  pinfo.cols.info:append(" " .. id[1] .. (is_reply and " reply" or " request"))
  if #texts > 0 then pinfo.cols.info:append(": " .. table.concat(texts, ", ")) end
end

function capture.dissector(buffer, pinfo, root)
  local fixed = 13
  if buffer:len() < fixed or buffer(0, 1):uint() ~= 1 then return 0 end
  local size = fixed + buffer(12, 1):uint()
  if buffer:len() < size then return 0 end
  local tree = root:add(capture, buffer(0, size))
  tree:add(head.version, buffer(0, 1))
  tree:add(head.kind, buffer(1, 1))
  tree:add(head.direction, buffer(2, 1))
  for _, flag in ipairs({head.redacted, head.timeout, head.line}) do tree:add(flag, buffer(3, 1)) end
  tree:add(head.id, buffer(4, 4))
  tree:add(head.duration, buffer(8, 4))
  tree:add(head.bus, buffer(fixed, size - fixed))
  local direction = buffer(2, 1):uint()
  pinfo.cols.protocol = "axlecast"
  pinfo.cols.info = directions[direction] or ("direction " .. direction)
  if buffer:len() == size then return buffer:len() end
  if buffer(1, 1):uint() == 0 and direction <= 1 then
    pinfo.private["axlecast_direction"] = tostring(direction)
    tformat.dissector(buffer(size):tvb(), pinfo, root)
  else
    Dissector.get("data"):call(buffer(size):tvb(), pinfo, root)
  end
  return buffer:len()
end

DissectorTable.get("wtap_encap"):add((wtap_encaps or wtap).USER0, capture)
