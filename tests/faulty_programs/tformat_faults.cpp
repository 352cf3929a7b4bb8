// axlecast-tformat that kills itself at a chosen transition: before or after it sends the bridge a message, or sends the
// encoder a request that changes something.
#include <algorithm>
#include <array>

#include "drivers/runtime/process/driver_main.h"
#include "tests/faulty_programs/kill_order.h"

namespace axlecast {

const Family& tformat_family();

namespace {

class FaultyLink final : public ByteLink {
 public:
  FaultyLink(ByteLink& link, Faults& faults) : link_(link), faults_(faults) {}

  [[nodiscard]] Result<> Open() override { return link_.Open(); }
  void Close() override { link_.Close(); }
  [[nodiscard]] bool IsOpen() const override { return link_.IsOpen(); }
  [[nodiscard]] Status Wait(MonoNs until) override { return link_.Wait(until); }
  void Wake() override { link_.Wake(); }
  [[nodiscard]] LineErrors Errors() const override { return link_.Errors(); }
  [[nodiscard]] bool SetBaud(std::int64_t baud) override { return link_.SetBaud(baud); }
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override {
    return link_.Read(into, deadline);
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override { return link_.ReadNow(into); }

  [[nodiscard]] bool Write(Bytes bytes) override {
    const bool changes = Changes(bytes);
    if (changes) faults_.Pass();
    const bool written = link_.Write(bytes);
    if (changes) faults_.Pass();
    return written;
  }

 private:
  // TS5669 spec 6.3.1, Table 1: the control fields of data IDs 6 (EEPROM write), 7, 8 and C (resets).
  static bool Changes(Bytes bytes) {
    constexpr std::array<std::uint8_t, 4> kChanging = {0x32, 0xBA, 0xC2, 0x62};
    return !bytes.empty() && std::find(kChanging.begin(), kChanging.end(), bytes[0]) != kChanging.end();
  }

  ByteLink& link_;
  Faults& faults_;
};

}  // namespace
}  // namespace axlecast

int main(int argc, char** argv) {
  using namespace axlecast;
  KillOrder order;
  return DriverMain(
      tformat_family(), argc, argv,
      {.link = [&](ByteLink& link) { return std::make_unique<FaultyLink>(link, order.faults); },
       .commands = [&](MessageSink& sink) { return std::make_unique<FaultySink>(sink, order.faults); }});
}
