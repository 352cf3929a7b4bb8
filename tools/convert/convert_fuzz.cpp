// Any events: no converter may crash, hang or write what its format does not allow.
#include <fuzzer/FuzzedDataProvider.h>

#include <axlecast/alarm_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/wire_t.hpp>
#include <cstdlib>
#include <string>

#include "tools/convert/conversion.h"
#include "tools/convert/plot.h"
#include "tools/convert/test_events.h"

namespace axlecast {
namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

// A head, and behind it any bytes: of a message of ours, cut or wrong as they may be.
void AddMessage(FuzzedDataProvider& input, TestEvents& events) {
  static const std::int64_t hashes[] = {position_t::getHash(),       wire_t::getHash(),
                                        alarm_t::getHash(),          device_info_t::getHash(),
                                        position_block_t::getHash(), motor_health_t::getHash()};
  auto hash = static_cast<std::uint64_t>(input.PickValueInArray(hashes));
  std::vector<std::uint8_t> bytes(8);
  for (std::size_t i = 8; i-- > 0; hash >>= 8U) bytes[i] = static_cast<std::uint8_t>(hash);
  const auto rest = input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 400));
  bytes.insert(bytes.end(), rest.begin(), rest.end());
  events.AddRaw(input.ConsumeIntegral<std::int64_t>(), input.ConsumeRandomLengthString(8), std::move(bytes));
}

void AddPosition(FuzzedDataProvider& input, TestEvents& events) {
  position_t position = TestPosition(input.ConsumeIntegral<std::int64_t>(), input.ConsumeIntegral<std::int64_t>(),
                                     input.ConsumeIntegral<std::int64_t>());
  if (input.ConsumeBool()) position.utime = input.ConsumeIntegral<std::uint16_t>();
  position.value = input.ConsumeFloatingPoint<double>();
  position.flags = input.ConsumeIntegral<std::int32_t>();
  events.Add(input.ConsumeIntegral<std::int64_t>(), input.ConsumeBool() ? "POSITION/a" : "POSITION/b", position);
}

void AddWire(FuzzedDataProvider& input, TestEvents& events) {
  wire_t wire{};
  wire.utime = input.ConsumeIntegral<std::int64_t>();
  wire.bus = input.ConsumeRandomLengthString(40);
  wire.kind = input.ConsumeIntegralInRange<std::int8_t>(0, 2);
  wire_record_t record{};
  record.dt_ns = input.ConsumeIntegral<std::int32_t>();
  record.direction = input.ConsumeIntegralInRange<std::int8_t>(-1, 10);
  record.id = input.ConsumeIntegral<std::int32_t>();
  record.data = input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 12));
  record.len = static_cast<std::int16_t>(record.data.size());
  wire.records.push_back(record);
  wire.n = 1;
  events.Add(0, "WIRE/w", wire);
}

// The cells of every record are as many as those of the first.
void CheckCsv(const std::string& text) {
  std::size_t wanted = 0;
  std::size_t cells = 1;
  bool quoted = false;
  for (const char c : text) {
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == ',') ++cells;
    if (c == '\n') {
      if (wanted == 0) wanted = cells;
      Require(cells == wanted);
      cells = 1;
    }
  }
  Require(!quoted);
}

}  // namespace
}  // namespace axlecast

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  FuzzedDataProvider input(data, size);
  TestEvents events;
  const std::string field = input.ConsumeRandomLengthString(20);
  while (input.remaining_bytes() > 0) {
    switch (input.ConsumeIntegralInRange(0, 2)) {
      case 0:
        AddMessage(input, events);
        break;
      case 1:
        AddPosition(input, events);
        break;
      default:
        AddWire(input, events);
    }
  }
  const EventRange range = events.range();
  const auto text = [&](auto write) {
    TestOutput output;
    output.room = 10'000;
    static_cast<void>(write(output.sink()));
    return output.text;
  };
  CheckCsv(text([&](const Output& out) { return WriteCsvTable(range, out); }));
  CheckCsv(text(
      [&](const Output& out) { return WriteCsvGrid(range, range, {.period_us = 1'000, .max_age_us = 0}, out); }));
  Require(text([&](const Output& out) { return WriteMcap(range, out); }).ends_with("\x89MCAP0\r\n"));
  static_cast<void>(text([&](const Output& out) { return WriteCandump(range, out); }));
  static_cast<void>(text([&](const Output& out) { return WritePcap(range, out); }));
  for (const PlotField& shown : {PlotField{"POSITION/a", "value"}, PlotField{"POSITION/b", field}}) {
    const Result<PlotData> plot = CollectPlot(range, {shown}, kPlotColumns);
    if (plot) Require(PlotSvg("title", *plot)->ends_with("</svg>\n"));
  }
  return 0;
}
