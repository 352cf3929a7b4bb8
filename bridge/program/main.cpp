#include "bridge/program/bridge_main.h"

int main(int argc, char** argv) { return axlecast::BridgeMain(argc, argv, {}); }
