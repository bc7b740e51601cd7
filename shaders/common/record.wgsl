// Records of general scenes: a small program on registers of a channel, which src/device/instructions.rs describes.

#constants INSTRUCTIONS
