// SPDX-License-Identifier: Apache-2.0
// JPEG pictures of the generated room. The browser that the tests use anyway encodes them.
import { kCamera, render } from "./world.mjs";

const kPictures = 8;
export const kSecondsBetween = 0.5;

async function encode(page, pixels) {
  const base64 = await page.evaluate(
    async ([data, width, height]) => {
      const canvas = new OffscreenCanvas(width, height);
      const bytes = Uint8ClampedArray.from(atob(data), (char) => char.charCodeAt(0));
      canvas.getContext("2d").putImageData(new ImageData(bytes, width, height), 0, 0);
      const blob = await canvas.convertToBlob({ type: "image/jpeg", quality: 0.85 });
      const jpeg = new Uint8Array(await blob.arrayBuffer());
      return btoa(jpeg.reduce((text, byte) => text + String.fromCharCode(byte), ""));
    },
    [Buffer.from(pixels.buffer).toString("base64"), kCamera.width, kCamera.height],
  );
  return Buffer.from(base64, "base64");
}

/** [{left, right, disparity}] as JPEG, `kSecondsBetween` apart. */
export async function pictures(browser) {
  const page = await browser.newPage();
  const all = [];
  for (let i = 0; i < kPictures; ++i) {
    const left = render(i * kSecondsBetween);
    const right = render(i * kSecondsBetween, 0.12);
    all.push({
      left: await encode(page, left.picture),
      right: await encode(page, right.picture),
      disparity: await encode(page, left.disparity),
    });
  }
  await page.close();
  return all;
}
