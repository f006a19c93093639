// validate.mjs FILE.glb...: Khronos' glTF validator. Exit code 1 on any error or warning.
import { readFile } from 'node:fs/promises';
import validator from 'gltf-validator';

const kSeverities = ['error', 'warning', 'info', 'hint'];
let failed = false;
for (const path of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(await readFile(path)), { uri: path });
  const { numErrors, numWarnings, messages } = report.issues;
  for (const message of messages) {
    console.log(`${path}: ${kSeverities[message.severity]}: ${message.pointer}: ${message.message}`);
  }
  console.log(`${path}: ${numErrors} errors, ${numWarnings} warnings`);
  failed ||= numErrors > 0 || numWarnings > 0;
}
process.exit(failed || process.argv.length < 3 ? 1 : 0);
