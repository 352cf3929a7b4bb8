#include "drivers/runtime/command/command_authority.h"
#include "tests/support/counting_family.h"

// Arbitrary bytes as a permit: as they are, inside a good envelope, and as the fields of a good permit. Nothing
// unsigned may ever count where keys are asked for.
namespace axlecast {
namespace {

constexpr std::int64_t kUtime = 1'700'000'000'000'000;

struct EveryClaim final : BaseClaims {
  [[nodiscard]] std::optional<BaseClaim> At(MonoNs mono) const override { return BaseClaim{2, mono, mono}; }
};

void Run(Bytes data) {
  const BusConfig bus = CountingBus("b0", {"axis1"});
  const EveryClaim claims;
  PermitTable open(bus, UnsignedBridge(), 1, &claims);
  BridgeConfig keys;
  keys.keys.emplace_back();
  keys.keys[0].role = Role::kControl;
  keys.keys[0].key[0] = 7;
  keys.keys[0].id = 9;
  PermitTable closed(bus, keys, 1, &claims);

  permit_t envelope{};
  envelope.permit.assign(data.begin(), data.end());
  envelope.permit.resize(std::min<std::size_t>(data.size(), 1'200));
  envelope.permit_size = static_cast<std::int16_t>(envelope.permit.size());
  permit_body_t body{};
  body.device = "axis1";
  body.operations = {std::string(data.begin(), data.end())};
  body.n_operations = 1;
  if (data.size() >= 40) {
    const auto number = [&](std::size_t at) {
      std::uint64_t bits = 0;
      for (std::size_t i = 0; i < 8; ++i) bits = bits << 8 | data[at + i];
      return static_cast<std::int64_t>(bits);
    };
    body.issuer_boot_id = number(0);
    body.issue = number(8);
    body.issued_utime = data[16] % 2 == 0 ? number(16) : kUtime;
    body.valid_ms = static_cast<std::int32_t>(number(24) % 600);
    body.key_id = data[32] % 2 == 0 ? 0 : 9;
    body.clock_id = data[33] % 3;
    body.base_id = data[34] % 4;
    body.issued_mono_ns = number(8);
    body.issued_base_ns = number(16);
    body.issued_half_width_ns = number(24);
  }
  for (PermitTable* book : {&open, &closed}) {
    book->Accept("axis1", data, kSecond, kUtime);
    book->Accept("axis1", Encoded(envelope), kSecond, kUtime);
    if (body.getEncodedSize() <= 30'000) book->Accept("axis1", Enveloped(body), kSecond, kUtime);
    for (const MonoNs now : {kSecond, 2 * kSecond}) {
      static_cast<void>(book->Check("axis1", "bump", now).has_value());
      if (book->Check("axis1", "bump", now).error().text.empty()) __builtin_trap();
    }
  }
  if (closed.Check("axis1", "bump", kSecond).has_value()) __builtin_trap();
}

}  // namespace
}  // namespace axlecast

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  axlecast::Run({data, size});
  return 0;
}
