// Any answers, strays and silences.
#include "drivers/tformat/family.h"

#include "tests/fuzz/probe_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::ProbeFuzz fuzz(axlecast::tformat_probe({}), input);
  fuzz.Run(
      [](axlecast::Bytes request) { return request.size() == 1 && (request[0] == 0x1A || request[0] == 0x92); });
  return 0;
}
