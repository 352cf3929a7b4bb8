// axlecast-bridge that kills itself at a chosen transition: before or after it writes a thing into its journal or sends
// one.
#include "bridge/program/bridge_main.h"
#include "tests/faulty_programs/kill_order.h"

int main(int argc, char** argv) {
  using namespace axlecast;
  KillOrder order;
  return BridgeMain(
      argc, argv,
      {.store =
           [&](std::unique_ptr<DurableStore> store) {
             return std::make_unique<FaultyStore>(std::move(store), order.faults);
           },
       .commands = [&](MessageSink& sink) { return std::make_unique<FaultySink>(sink, order.faults); }});
}
