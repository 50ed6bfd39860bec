var L=Math.PI/180;function H([s,e,t]){let o=Math.hypot(s,e,t);if(o<1e-12)return[1,0,0,0,1,0,0,0,1];[s,e,t]=[s/o,e/o,t/o];let r=Math.cos(o),i=Math.sin(o),n=1-r;return[r+s*s*n,s*e*n-t*i,s*t*n+e*i,e*s*n+t*i,r+e*e*n,e*t*n-s*i,t*s*n-e*i,t*e*n+s*i,r+t*t*n]}function $(s,e,t=0){let[o,r]=[Math.cos(s*L),Math.sin(s*L)],[i,n]=[Math.cos(e*L),Math.sin(e*L)],[c,a]=[Math.cos(-t*L),Math.sin(-t*L)],l=X([o,0,r,0,1,0,-r,0,o],[1,0,0,0,i,-n,0,n,i]);return X(l,[c,-a,0,a,c,0,0,0,1])}function X(s,e){let t=new Array(9);for(let o=0;o<3;o++)for(let r=0;r<3;r++)t[3*o+r]=s[3*o]*e[r]+s[3*o+1]*e[3+r]+s[3*o+2]*e[6+r];return t}var N=(s,[e,t,o])=>[s[0]*e+s[1]*t+s[2]*o,s[3]*e+s[4]*t+s[5]*o,s[6]*e+s[7]*t+s[8]*o];function P(s){let{focal:e,center:t,translation:o,width:r,height:i}=s;return{rotation:H(s.rotation),translation:o,focal:e,center:t,width:r,height:i}}function ee(s,e,t,o){let i=N(s.rotation,o).map((a,l)=>a+s.translation[l]),n=$(e,t),c=N(n,o);return{...s,rotation:n,translation:i.map((a,l)=>a-c[l])}}function I(s,e,t,o,r,i=[0,0]){return{...s,focal:s.focal*t,center:[(s.center[0]-e[0])*t+o/2+i[0],(s.center[1]-e[1])*t+r/2+i[1]],width:o,height:r}}function te(s,e,t){let o=N(e,t),r=N(s.rotation,t.map((i,n)=>i-o[n]));return{...s,rotation:X(s.rotation,e),translation:s.translation.map((i,n)=>i+r[n])}}function oe(s,e){let[t,o,r]=N(s.rotation,e).map((n,c)=>n+s.translation[c]),i=s.focal/-r;return[s.center[0]+t*i,s.center[1]-o*i,-r]}function re({rotation:s,translation:e}){return new Float32Array([s[0],s[3],s[6],0,s[1],s[4],s[7],0,s[2],s[5],s[8],0,e[0],e[1],e[2],1])}function se({focal:s,center:e,width:t,height:o,translation:r}){let i=-r[2],n=Math.max(i-450,i*.05,1),c=i+550;return new Float32Array([2*s/t,0,0,0,0,2*s/o,0,0,1-2*e[0]/t,2*e[1]/o-1,-(c+n)/(c-n),-1,0,0,-2*c*n/(c-n),0])}var v=class extends Error{},ne=/^[A-Za-z0-9_][A-Za-z0-9._-]*$/,De=64*2**20,Se=256*2**20,Ue=16384,y=52,ie=8;async function ce(s){let e=new URL(s.endsWith("/")?s:s+"/",document.baseURI),t=async i=>{let n=await fetch(new URL(i,e));if(!n.ok)throw new v(`${i}: ${n.status} ${n.statusText}`);return new Uint8Array(await n.arrayBuffer())},o=["","web/"];e.pathname.endsWith(".avatar/")&&o.reverse();let r=null;for(let i of o){let n=c=>t(i+c);try{let c=JSON.parse(new TextDecoder().decode(await n("avatar.json")));if(!Array.isArray(c.files))return{description:c,file:n}}catch(c){if(!(c instanceof v))throw c;r??=c}}throw r??new v(`${s}: holds no web/avatar.json; bake it again`)}var V=s=>s.geometry??"head.glb";function he(s){let e=(n,c)=>{if(!n)throw new v(`the bundle's web/avatar.json: ${c}; bake it again`)};e(s&&s.$schema==="urn:bakery:schema:web-1","is not one");let t=String(s.asset?.version);e(/^1\.\d+$/.test(t),`has version ${t.slice(0,20)}, this player reads 1.x`),e(le(s),"holds a number that is none");let o=s.expressions;e(Array.isArray(o)&&o.length===y,"lacks the 52 expressions"),e(ne.test(V(s)),"names a file outside of its folder"),e(o.every(n=>/^[A-Za-z]{1,40}$/.test(n)),"has an odd expression"),e(s.keys?.length>=1&&s.keys.length<=ie,`needs 1 to ${ie} keys`),e(s.keys.every(n=>A(n.weights,y)),"keys lack weights"),e(A(s.lips?.rest,80)&&s.lips.shapes?.length===y,"lacks the lips"),e(s.lips.shapes.every(n=>A(n,80)),"lacks the lips"),e(s.mouths?.length>=1&&s.mouths.length<=300,"needs 1 to 300 mouths"),e(s.mouths.every(n=>A(n,80)),"mouths lack landmarks"),e(s.gaze?.length>=1&&s.gaze.every(n=>A(n,2)),"lacks gaze"),e(A(s.pose?.weights,y),"lacks the pose of the photo"),e(A(s.pivot,3)&&s.light?.length===9,"lacks its frame"),e(s.eyes?.cap>0&&A(s.eyes.degrees,2),"lacks eyes"),e(s.eyes.centers?.length===2&&s.eyes.centers.every(n=>A(n,3)),"lacks eyes");for(let n of["photo_camera","front_camera"]){let c=s[n];e(c&&c.focal>0&&A(c.center,2),`lacks ${n}`),e(A(c.rotation,3)&&A(c.translation,3),`lacks ${n}`),e(c.width>0&&c.height>0,`lacks ${n}`)}for(let n of["mouth_sheet","eye_cap_left","eye_cap_right"])e(A(s.uv?.[n],4),`lacks the place of ${n}`);let r=["neutral",...s.keys.map(n=>n.name),"gaze","mouths","masks","coverage"];for(let n of r)e(Object.hasOwn(s.atlases??{},n),"lacks a picture");for(let n of Object.values(s.atlases))e(ne.test(n.file??""),"names a file outside of its folder"),e(ae(n.columns)&&ae(n.rows),"has an odd grid"),e(n.names?.length<=n.columns*n.rows,"has an odd grid");let i=(n,c)=>e(s.atlases[n].names.length===c,`${n} differ in number`);i("gaze",s.gaze.length),i("mouths",s.mouths.length),i("masks",y)}var A=(s,e)=>Array.isArray(s)&&s.length===e&&s.every(t=>typeof t=="number"),ae=s=>Number.isInteger(s)&&s>=1&&s<=1024;function le(s){return typeof s=="number"?Number.isFinite(s):s&&typeof s=="object"?Object.values(s).every(le):!0}function Le(s){let e=new DataView(s.buffer,s.byteOffset,s.byteLength),t=o=>String.fromCharCode(...s.subarray(o,o+4));if(s.length>24&&e.getUint32(0)===2303741511)return[e.getUint32(16),e.getUint32(20)];if(s.length>30&&t(0)==="RIFF"&&t(8)==="WEBP"){let o=t(12);if(o==="VP8 ")return[e.getUint16(26,!0)&16383,e.getUint16(28,!0)&16383];if(o==="VP8L"){let r=e.getUint32(21,!0);return[(r&16383)+1,(r>>>14&16383)+1]}if(o==="VP8X"){let r=i=>e.getUint16(i,!0)+(s[i+2]<<16);return[r(24)+1,r(27)+1]}}throw new v("a picture of the bundle is neither PNG nor WebP; bake it again")}async function fe(s,e){let t=await s.file(e.file);if(t.length>Se)throw new v(`${e.file}: too large`);let[o,r]=Le(t);if(o*r>De||Math.max(o,r)>Ue)throw new v(`${e.file}: ${o} x ${r} pixels, more than any bundle has`);if(o%e.columns||r%e.rows)throw new v(`${e.file}: does not divide into its grid; bake it again`);let i=t[0]===137?"image/png":"image/webp";return createImageBitmap(new Blob([t],{type:i}),{premultiplyAlpha:"none",colorSpaceConversion:"none"})}var b=class{constructor(e,t,o){this.gl=e,this.handle=e.createProgram();for(let[r,i]of[[e.VERTEX_SHADER,t],[e.FRAGMENT_SHADER,o]]){let n=e.createShader(r);e.shaderSource(n,`#version 300 es
`+i),e.compileShader(n),e.attachShader(this.handle,n),e.deleteShader(n)}e.linkProgram(this.handle),this.places=null}use(){let{gl:e}=this;if(e.useProgram(this.handle),this.places)return;if(!e.getProgramParameter(this.handle,e.LINK_STATUS)&&!e.isContextLost()){let o=e.getAttachedShaders(this.handle).map(r=>e.getShaderInfoLog(r));throw new v(`this browser's graphics refuse a shader: ${o.join(" ").slice(0,300)}`)}this.places=new Map;let t=e.getProgramParameter(this.handle,e.ACTIVE_UNIFORMS);for(let o=0;o<t;o++){let r=e.getActiveUniform(this.handle,o).name.replace("[0]","");this.places.set(r,e.getUniformLocation(this.handle,r))}}at(e){return this.places.get(e)??null}textures(e){let{gl:t}=this,o=0;for(let[r,[i,n]]of Object.entries(e))t.activeTexture(t.TEXTURE0+o),t.bindTexture(i,n),t.uniform1i(this.at(r),o++)}};function S(s,{format:e,width:t,height:o,layers:r=0,linear:i=!1}){let n=r?s.TEXTURE_2D_ARRAY:s.TEXTURE_2D,c=s.createTexture();s.bindTexture(n,c),r?s.texStorage3D(n,1,e,t,o,r):s.texStorage2D(n,1,e,t,o);let a=i?s.LINEAR:s.NEAREST;return s.texParameteri(n,s.TEXTURE_MIN_FILTER,a),s.texParameteri(n,s.TEXTURE_MAG_FILTER,a),s.texParameteri(n,s.TEXTURE_WRAP_S,s.CLAMP_TO_EDGE),s.texParameteri(n,s.TEXTURE_WRAP_T,s.CLAMP_TO_EDGE),c}var k=class{constructor(e,{format:t,width:o,height:r,count:i=1,linear:n=!1,depth:c=!1}){this.gl=e,this.width=o,this.height=r,this.textures=Array.from({length:i},()=>S(e,{format:t,width:o,height:r,linear:n})),this.handle=e.createFramebuffer(),e.bindFramebuffer(e.FRAMEBUFFER,this.handle);let a=this.textures.map((l,h)=>(e.framebufferTexture2D(e.FRAMEBUFFER,e.COLOR_ATTACHMENT0+h,e.TEXTURE_2D,l,0),e.COLOR_ATTACHMENT0+h));e.drawBuffers(a),this.depth=null,c&&(this.depth=e.createRenderbuffer(),e.bindRenderbuffer(e.RENDERBUFFER,this.depth),e.renderbufferStorage(e.RENDERBUFFER,e.DEPTH_COMPONENT24,o,r),e.framebufferRenderbuffer(e.FRAMEBUFFER,e.DEPTH_ATTACHMENT,e.RENDERBUFFER,this.depth)),this.complete=e.checkFramebufferStatus(e.FRAMEBUFFER)===e.FRAMEBUFFER_COMPLETE,e.bindFramebuffer(e.FRAMEBUFFER,null)}bind(){this.gl.bindFramebuffer(this.gl.FRAMEBUFFER,this.handle),this.gl.viewport(0,0,this.width,this.height)}dispose(){let{gl:e}=this;this.textures.forEach(t=>e.deleteTexture(t)),this.depth&&e.deleteRenderbuffer(this.depth),e.deleteFramebuffer(this.handle)}};var Pe=[0,2,4,8];function Y(s,e,t){let o=s.length-t;if(s[0]!==160||o<1)throw new v("packed vertices of another version");let r=new Uint8Array(e*t),i=s.slice(o),n=Math.min((8192/t|0)&-16,256),c=new Uint8Array(256),a=1;for(let l=0;l<e;l+=n){let h=Math.min(n,e-l),p=h+15>>4;for(let f=0;f<t;f++){let d=a;a+=p+3>>2;for(let m=0;m<p;m++){let g=s[d+(m>>2)]>>((m&3)<<1)&3;a=Ne(s,a,Pe[g],c,m<<4)}if(a>o)throw new v("packed vertices that end too soon");let u=i[f];for(let m=0,g=l*t+f;m<h;m++,g+=t){let w=c[m];u=u+(w>>>1^-(w&1))&255,r[g]=u}i[f]=u}}return r}function Ne(s,e,t,o,r){if(t===0)return o.fill(0,r,r+16),e;if(t===8){for(let a=0;a<16;a++)o[r+a]=s[e+a];return e+16}let i=(1<<t)-1,n=8/t,c=e+16/n;for(let a=0;a<16;a++){let l=8-t-a%n*t,h=s[e+(a/n|0)]>>l&i;o[r+a]=h===i?s[c++]:h}return c}function j(s,e){if(s[0]!==209)throw new v("packed indices of another version");let t=new Uint32Array(e),o=new Uint32Array(2),r=1;for(let i=0;i<e;i++){let n=0,c,a=0;do{if(r>=s.length)throw new v("packed indices that end too soon");c=s[r++],n|=(c&127)<<a,a+=7}while(c>127);let l=n&1,h=n>>>1;t[i]=o[l]+=h>>>1^-(h&1)}return t}var F=["eye_cap_left","eye_cap_right","skin","mouth_sheet","tongue","inside","teeth","tear","lashes"],W=F.slice(7),ue=65535;function me(s){let{document:e,binary:t}=Ie(s),o=e.meshes?.[0],r=e.nodes?.[0]?.scale;(!o||!r||o.extras?.targetNames?.length!==y)&&R("lacks its 52 shapes");let i=r[0]*1e3,n=new Map(o.primitives.map(m=>[e.materials[m.material].name,m])),c=F.filter(m=>n.has(m));F.slice(0,4).some(m=>!n.has(m))&&R("lacks its skin, eyes or mouth");let a=m=>Oe(e,t,m),l=c.map(m=>e.accessors[n.get(m).attributes.POSITION].count),h=l.reduce((m,g)=>m+g,0);h>ue&&R(`has ${h} vertices, more than ${ue}`);let p=c.map(m=>e.accessors[n.get(m).indices].count),f={positions:new Float32Array(3*h),normals:new Int8Array(4*h),uv:new Float32Array(2*h),part:new Uint8Array(h),indices:new Uint16Array(p.reduce((m,g)=>m+g,0)),shapes:new Int16Array(y*4*h),reach:i,ranges:{}},d=0,u=0;return c.forEach((m,g)=>{let{attributes:w,indices:T,targets:E}=n.get(m),M=a(w.POSITION);for(let x=0;x<M.length;x++)f.positions[3*d+x]=M[x]*i;f.normals.set(a(w.NORMAL),4*d),f.uv.set(a(w.TEXCOORD_0),2*d),f.part.fill(F.indexOf(m),d,d+l[g]);let _=a(T);for(let x=0;x<_.length;x++)_[x]>=l[g]&&R("has a triangle without a corner"),f.indices[u+x]=_[x]+d;E?.length!==y&&R("lacks its 52 shapes"),E.forEach((x,D)=>f.shapes.set(a(x.POSITION),4*(D*h+d))),f.ranges[m]=[u,_.length],d+=l[g],u+=_.length}),f}function R(s){throw new v(`the bundle's head for browsers ${s}; bake it again`)}function Ie(s){let e=new DataView(s.buffer,s.byteOffset,s.byteLength);(s.length<20||e.getUint32(0,!0)!==1179937895)&&R("is no GLB file");let t=e.getUint32(12,!0);return 20+t+8>s.length&&R("is cut short"),{document:JSON.parse(new TextDecoder().decode(s.subarray(20,20+t))),binary:s.subarray(28+t)}}var Ce={5120:Int8Array,5122:Int16Array,5123:Uint16Array,5125:Uint32Array,5126:Float32Array};function Oe(s,e,t){let o=s.accessors[t],r=s.bufferViews[o.bufferView].extensions.EXT_meshopt_compression,{byteOffset:i=0,byteLength:n,byteStride:c,count:a,mode:l}=r;(a!==o.count||a>4*2**20||c>256)&&R("is damaged"),i+n>e.length&&R("is cut short");let h=e.subarray(i,i+n),p=Ce[o.componentType];return l==="ATTRIBUTES"?new p(Y(h,a,c).buffer):p.from(j(h,a))}var C=class{constructor(e,t){this.size=t.rest.length,this.known=new Float64Array(e.length*this.size),this.length=new Float64Array(e.length),e.forEach((o,r)=>{this.known.set(o,r*this.size),this.length[r]=Math.hypot(...o)}),this.rest=Float64Array.from(t.rest),this.shapes=t.shapes.map(o=>Float64Array.from(o)),this.moves=this.shapes.map(o=>o.some(r=>r!==0)),this.wanted=new Float64Array(this.size),this.score=new Float64Array(e.length),this.order=Array.from(e,(o,r)=>r),this.count=Math.min(50,e.length),this.index=new Uint16Array(this.count),this.weight=new Float64Array(this.count)}find(e){let{wanted:t,known:o,score:r,size:i,order:n}=this;t.set(this.rest);for(let u=0;u<e.length;u++){let m=e[u];if(m===0||!this.moves[u])continue;let g=this.shapes[u];for(let w=0;w<i;w++)t[w]+=m*g[w]}let c=0;for(let u=0;u<i;u++)c+=t[u]*t[u];let a=Math.sqrt(c);for(let u=0,m=0;u<r.length;u++){let g=0;for(let w=0;w<i;w++,m++)g+=o[m]*t[w];r[u]=g/(this.length[u]*a)}n.sort((u,m)=>r[m]-r[u]||u-m);let l=1-r[n[0]],h=Math.max(.25*l,1e-4),p=0,f=!1,d=new Float64Array(this.count);for(let u=0;u<this.count;u++)d[u]=Math.exp((l-(1-r[n[u]]))/h),p+=d[u];for(let u=0;u<this.count;u++){let m=d[u]/p;f||=this.index[u]!==n[u]||Math.abs(this.weight[u]-m)>1e-7,this.index[u]=n[u],this.weight[u]=m}return f}};function pe(s,e){let t=0,o=1/0;return s.forEach(([r,i],n)=>{let c=(r-e[0])**2+(i-e[1])**2;c<o&&([t,o]=[n,c])}),t}var de=64,Be=.12,O=class{constructor(e,t){this.view=P(e.photo_camera),this.columns=de,this.rows=Math.max(8,Math.round(de*this.view.height/this.view.width)),this.step=t.reach/32767;let o=e.pose.weights,r=this.#e(t,o);this.mass=this.#o(r),this.cells=Int32Array.from(r.keys()).filter(c=>r[c]>=0);let i=this.cells.length,n=t.part.length;this.rest=new Float32Array(3*i),this.shapes=o.map(()=>new Int16Array(3*i)),this.cells.forEach((c,a)=>{let l=r[c];for(let h=0;h<3;h++)this.rest[3*a+h]=t.positions[3*l+h],this.shapes.forEach((p,f)=>{p[3*a+h]=t.shapes[4*(f*n+l)+h]})}),this.place=new Float32Array(3*i),this.values=new Float32Array(2*r.length),this.before=new Float32Array(2*i),this.#r(o,this.before)}#e(e,t){let{columns:o,rows:r}=this,[i,n]=e.ranges.skin,c=e.part.length,a=[...new Set(e.indices.subarray(i,i+n))],l=Float32Array.from({length:3*a.length},(u,m)=>e.positions[3*a[Math.floor(m/3)]+m%3]);t.forEach((u,m)=>{if(u)for(let g=0;g<a.length;g++){let w=4*(m*c+a[g]);for(let T=0;T<3;T++)l[3*g+T]+=u*this.step*e.shapes[w+T]}});let h=new Float32Array(2*a.length),p=this.#t(l,h),f=new Int32Array(o*r).fill(-1),d=new Float32Array(f.length).fill(1/0);for(let u=0;u<a.length;u++){let m=Math.floor(h[2*u]*o),g=Math.floor(h[2*u+1]*r);if(m<0||g<0||m>=o||g>=r)continue;let w=g*o+m;p[u]<d[w]&&([d[w],f[w]]=[p[u],a[u]])}return f}#t(e,t){let{rotation:o,translation:r,focal:i,center:n,width:c,height:a}=this.view,l=e.length/3,h=new Float32Array(l);for(let p=0;p<l;p++){let[f,d,u]=[e[3*p],e[3*p+1],e[3*p+2]];h[p]=-(o[6]*f+o[7]*d+o[8]*u+r[2]);let m=i/h[p];t[2*p]=(n[0]+(o[0]*f+o[1]*d+o[2]*u+r[0])*m)/c,t[2*p+1]=(n[1]-(o[3]*f+o[4]*d+o[5]*u+r[1])*m)/a}return h}#r(e,t){this.place.set(this.rest),this.shapes.forEach((o,r)=>{let i=e[r]*this.step;if(i!==0)for(let n=0;n<o.length;n++)this.place[n]+=i*o[n]}),this.#t(this.place,t)}#o(e){let{columns:t,rows:o}=this,r=Float32Array.from(e,c=>c>=0?0:1e3),i=(c,a,l)=>{r[a]+l<r[c]&&(r[c]=r[a]+l)};for(let c=0;c<2;c++)for(let a=0;a<r.length;a++){let l=c?r.length-1-a:a,h=l%t,p=(l-h)/t,f=c?1:-1;h+f>=0&&h+f<t&&i(l,l+f,1),p+f>=0&&p+f<o&&(i(l,l+f*t,1),h>0&&i(l,l+f*t-1,1.4),h<t-1&&i(l,l+f*t+1,1.4))}let n=Be*o;return r.map(c=>c===0?1:Math.min(Math.max(c/n-1,0),1))}at(e){let{cells:t,values:o,before:r}=this,i=new Float32Array(r.length);this.#r(e,i);for(let n=0;n<t.length;n++)o[2*t[n]]=r[2*n]-i[2*n],o[2*t[n]+1]=r[2*n+1]-i[2*n+1];return ge(o,this.mass,this.columns,this.rows)}};function ge(s,e,t,o){if(Math.min(t,o)<2)return s;let[r,i]=[t+1>>1,o+1>>1],n=new Float32Array(2*r*i),c=new Float32Array(r*i);for(let h=0;h<o;h++)for(let p=0;p<t;p++){let f=h*t+p,d=(h>>1)*r+(p>>1);c[d]+=e[f],n[2*d]+=e[f]*s[2*f],n[2*d+1]+=e[f]*s[2*f+1]}for(let h=0;h<c.length;h++){let p=c[h]>0?1/c[h]:0;n[2*h]*=p,n[2*h+1]*=p,c[h]=Math.min(1,c[h])}let a=ge(n,c,r,i),l=new Float32Array(s.length);for(let h=0;h<o;h++)for(let p=0;p<t;p++){let f=h*t+p,d=Math.min(Math.max((p-.5)/2,0),r-1),u=Math.min(Math.max((h-.5)/2,0),i-1),[m,g]=[Math.floor(d),Math.floor(u)],[w,T]=[Math.min(m+1,r-1),Math.min(g+1,i-1)];for(let E=0;E<2;E++){let M=a[2*(g*r+m)+E]*(1-d+m)+a[2*(g*r+w)+E]*(d-m),_=a[2*(T*r+m)+E]*(1-d+m)+a[2*(T*r+w)+E]*(d-m),x=M*(1-u+g)+_*(u-g);l[2*f+E]=e[f]*s[2*f+E]+(1-e[f])*x}}return l}var we=`
vec3 toLinear(vec3 c) {
  return mix(c / 12.92, pow((max(c, 0.04045) + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}
vec3 toEncoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`,U=`
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`,ve=`
precision highp float;
uniform sampler2D atlas;
uniform int first, columns, count, side;
out vec4 mask;
float cell(int number) {
  if (number >= count) return 0.0;
  ivec2 corner = ivec2(number % columns, number / columns) * side;
  return texelFetch(atlas, corner + ivec2(gl_FragCoord.xy), 0).r;
}
void main() { mask = vec4(cell(first), cell(first + 1), cell(first + 2), cell(first + 3)); }`,xe=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray masks;
uniform int groups;
uniform int group[13];
uniform vec4 product[104]; // a_e^k a_e^t, four expressions each, eight keys a group
layout(location = 0) out vec4 low;
layout(location = 1) out vec4 high;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  low = vec4(0.0);
  high = vec4(0.0);
  for (int g = 0; g < groups; g++) {
    vec4 a = texelFetch(masks, ivec3(place, group[g]), 0);
    int k = 8 * group[g];
    low += vec4(dot(a, product[k]), dot(a, product[k + 1]), dot(a, product[k + 2]), dot(a, product[k + 3]));
    high += vec4(dot(a, product[k + 4]), dot(a, product[k + 5]), dot(a, product[k + 6]), dot(a, product[k + 7]));
  }
  float total = dot(low, vec4(1.0)) + dot(high, vec4(1.0));
  float scale = 1.0 / max(1.0, total); // w_0 + sum is 1 or, where w_0 is 0, the sum
  low *= scale;
  high *= scale;
}`,Ee=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray faces;
uniform sampler2D low, high, hair;
uniform int keys;
uniform bool hairy;
out vec4 color;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec2 uv = gl_FragCoord.xy / vec2(textureSize(faces, 0).xy);
  vec4 one = texture(low, uv), two = texture(high, uv);
  float w[8] = float[](one.x, one.y, one.z, one.w, two.x, two.y, two.z, two.w);
  float rest = 1.0 - dot(one, vec4(1.0)) - dot(two, vec4(1.0));
  vec3 c = rest * texelFetch(faces, ivec3(place, 0), 0).rgb;
  for (int k = 0; k < keys; k++)
    if (w[k] > 1e-4) c += w[k] * texelFetch(faces, ivec3(place, k + 1), 0).rgb;
  if (hairy) {
    vec4 h = texelFetch(hair, place, 0);
    c = c * (1.0 - h.a) + h.rgb * h.a;
  }
  color = vec4(c, 1.0);
}`,ye=`
precision highp float;
uniform sampler2D mouths;
uniform int columns, count;
uniform ivec2 cell;
uniform vec2 neighbour[50]; // index, weight
out vec4 median;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec3 seen[50];
  float total = 0.0;
  for (int n = 0; n < count; n++) {
    int index = int(neighbour[n].x);
    ivec2 corner = ivec2(index % columns, index / columns) * cell;
    seen[n] = floor(texelFetch(mouths, corner + place, 0).rgb * 255.0 + 0.5);
    total += neighbour[n].y;
  }
  vec3 value = vec3(0.0);
  for (float bit = 128.0; bit >= 1.0; bit *= 0.5) {
    vec3 most = value + bit - 1.0; // with this bit 0
    vec3 reached = vec3(0.0);
    for (int n = 0; n < count; n++) reached += neighbour[n].y * vec3(lessThanEqual(seen[n], most));
    value += bit * vec3(lessThan(reached, vec3(0.5 * total)));
  }
  median = vec4(value / 255.0, 1.0);
}`,Ae=`
precision highp float;
precision highp isampler2DArray;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 texel;
layout(location = 3) in uint piece;
uniform mat4 view, projection;
uniform isampler2DArray shapes;
uniform int count;
uniform vec2 moving[52]; // shape, millimetres of a step
uniform vec2 cards; // how much of the left and of the right eye's lashes shows
const float BEHIND = 8.0; // mm
flat out float shows;
out vec2 uv;
out vec3 bent;
out vec2 place; // mm: height at rest and depth
flat out uint part;
void main() {
  vec3 p = position;
  ivec2 cell = ivec2(gl_VertexID & 255, gl_VertexID >> 8);
  for (int k = 0; k < count; k++)
    p += moving[k].y * vec3(texelFetch(shapes, ivec3(cell, int(moving[k].x)), 0).xyz);
  uv = texel;
  part = piece;
  bent = normal.xyz;
  place = vec2(position.y, p.z);
  shows = position.x < 0.0 ? cards.y : cards.x;
  vec4 seen = view * vec4(p, 1.0);
  gl_Position = projection * seen;
  if (piece == 3u) { // farther, for the tongue; render.BEHIND is the reference
    vec4 behind = projection * (seen - vec4(0.0, 0.0, BEHIND, 0.0));
    gl_Position.z = behind.z / behind.w * gl_Position.w;
  }
}`,Te=`
precision highp float;
precision highp sampler2DArray;
in vec2 uv;
in vec3 bent;
in vec2 place;
flat in float shows;
flat in uint part;
uniform sampler2D face, mouth, gaze, coverage, photo, flow, hair;
uniform sampler2DArray masks;
uniform vec4 places[3]; // rectangles of eye_cap_left, eye_cap_right, mouth_sheet in the atlas
uniform ivec2 eyeCell, eyeCorner;
uniform vec2 slide; // of the eyes' picture, beyond its own direction
uniform int layer, shown;
uniform bool lit, inPhoto, soft, geometry;
uniform vec3 light[9], fresh[9]; // the photo's, relative to its camera; another, relative to the head
uniform mat3 photographed; // head to the photo's camera
uniform float exposure; // keeps the face as bright as it was, on average
uniform float lips; // mm: how far forward they are at rest
uniform vec2 fade; // mm, where the bust ends and where it is whole
uniform vec4 frame; // of the photo: left, top, width, height in pixels of the target
uniform float tall; // pixels of the target
uniform float scale; // pixels a millimetre
const float SHADE = 1.4; // mm
out vec4 color;
${we}
vec3 four(sampler2D map, ivec2 corner, ivec2 size, vec2 local) {
  vec2 p = local * vec2(size) - 0.5;
  vec2 low = floor(p);
  vec2 t = p - low;
  ivec2 a = clamp(ivec2(low), ivec2(0), size - 1), b = clamp(ivec2(low) + 1, ivec2(0), size - 1);
  vec3 aa = toLinear(texelFetch(map, corner + a, 0).rgb);
  vec3 ba = toLinear(texelFetch(map, corner + ivec2(b.x, a.y), 0).rgb);
  vec3 ab = toLinear(texelFetch(map, corner + ivec2(a.x, b.y), 0).rgb);
  vec3 bb = toLinear(texelFetch(map, corner + b, 0).rgb);
  return mix(mix(aa, ba, t.x), mix(ab, bb, t.x), t.y);
}
// As the reference reads it: no mipmaps, colour multiplied by alpha before it is mixed.
vec4 exactCard(vec2 uv) {
  ivec2 size = textureSize(hair, 0);
  vec2 p = uv * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(p));
  vec2 t = p - floor(p);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 step = ivec2(k & 1, k >> 1);
    vec4 one = texelFetch(hair, clamp(low + step, ivec2(0), size - 1), 0);
    vec2 share = mix(1.0 - t, t, vec2(step));
    sum += share.x * share.y * vec4(one.rgb * one.a, one.a);
  }
  return vec4(sum.rgb / max(sum.a, 1e-6), sum.a);
}
vec3 shine(vec3 rows[9], vec3 n) { // as bakery/geometry/harmonics.py
  return 0.282095 * rows[0] + 0.488603 * (n.y * rows[1] + n.z * rows[2] + n.x * rows[3])
    + 1.092548 * (n.x * n.y * rows[4] + n.y * n.z * rows[5] + n.x * n.z * rows[7])
    + 0.315392 * (3.0 * n.z * n.z - 1.0) * rows[6] + 0.546274 * (n.x * n.x - n.y * n.y) * rows[8];
}
float luma(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }
float shade(float behind) { return 0.05 + 0.6 * exp(-max(behind, 0.0) / 13.0); }
vec3 heat(float x) {
  return clamp(vec3(1.9 * x, 2.4 * x - 0.7, 0.25 + 1.6 * x - 2.6 * x * x + 1.2 * x * x * x), 0.0, 1.0);
}
void main() {
  if (part > 6u) { // lashes and tear line
    vec4 card = soft ? texture(hair, uv) : exactCard(uv);
    color = vec4(toEncoded(card.rgb), card.a * shows);
    return;
  }
  vec3 c;
  float known = 1.0;
  if (part == 3u) {
    vec2 local = (uv - places[2].xy) / places[2].zw;
    c = four(mouth, ivec2(0), textureSize(mouth, 0), local);
    if (soft) { // the lips' shade, so that the sheet does not end at a line
      vec2 away = min(local, 1.0 - local) / max(fwidth(local), 1e-5) / scale; // mm
      c *= mix(vec3(0.42, 0.34, 0.33), vec3(1.0), smoothstep(0.0, SHADE, min(away.x, away.y)));
    }
  } else if (part < 2u) {
    vec4 box = places[int(part)];
    c = four(gaze, eyeCorner + ivec2(int(part), 0) * eyeCell, eyeCell, (uv - box.xy) / box.zw - slide);
  } else {
    c = texture(face, uv).rgb;
    if (part == 2u) known = texture(coverage, uv).r;
    else if (geometry) c *= shade(lips - place.y) * vec3(1.0, 0.93, 0.9); // light falls off behind the lips
  }
  if (layer == 1) {
    ivec3 size = textureSize(masks, 0);
    float a = texture(masks, vec3(uv, float(shown / 4)))[shown % 4];
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? toLinear(heat(a)) * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 2) {
    int kind = int(texelFetch(coverage, ivec2(uv * vec2(textureSize(coverage, 0))), 0).g * 4.25 + 0.5);
    vec3 tint = kind == 1 ? vec3(0.10, 0.55, 0.25) : kind == 2 ? vec3(0.10, 0.35, 0.75)
      : kind == 3 ? vec3(0.85, 0.45, 0.05) : kind == 4 ? vec3(0.65, 0.10, 0.45) : vec3(0.2);
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? tint * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 3) {
    vec2 line = abs(fract(uv * 32.0) - 0.5);
    float grid = smoothstep(0.46, 0.48, max(line.x, line.y));
    float check = mod(floor(uv.x * 32.0) + floor(uv.y * 32.0), 2.0);
    c = mix(vec3(uv, 0.35) * (0.55 + 0.35 * check), vec3(0.9), grid * 0.6);
  } else if (lit) {
    vec3 n = normalize(bent);
    float was = luma(shine(light, photographed * n)) / max(luma(shine(light, vec3(0.0, 0.0, 1.0))), 1e-4);
    c *= exposure * max(shine(fresh, n), 0.02) / clamp(was, 0.45, 1.5);
  }
  float alpha = 1.0;
  if (inPhoto) {
    vec2 here = (vec2(gl_FragCoord.x, tall - gl_FragCoord.y) - frame.xy) / frame.zw;
    vec3 around = texture(photo, here + texture(flow, here).xy).rgb;
    if (layer == 0) c = mix(around, c, known);
  } else if (soft) {
    alpha *= smoothstep(fade.x, fade.y, place.x);
  }
  color = vec4(toEncoded(c), alpha);
}`,_e=`
precision highp float;
uniform sampler2D photo, flow;
uniform vec4 frame;
uniform vec2 size;
uniform bool inPhoto, plain;
uniform vec3 wall, floorTint;
out vec4 color;
${we}
float noise(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }
void main() {
  vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
  if (plain) {
    color = vec4(toEncoded(vec3(0.18)), 1.0);
    return;
  }
  vec2 unit = pixel / size;
  vec2 away = (unit - vec2(0.5, 0.42)) * vec2(size.x / size.y, 1.0);
  vec3 c = mix(wall, floorTint, smoothstep(0.05, 1.0, length(away) * 1.15));
  vec3 encoded = c + (noise(gl_FragCoord.xy) - 0.5) / 255.0; // against bands
  if (inPhoto) {
    vec2 here = (pixel - frame.xy) / frame.zw;
    float far = max(max(-here.x, here.x - 1.0), max(-here.y, here.y - 1.0));
    vec3 around = textureLod(photo, clamp(here, vec2(0.02), vec2(0.98)), 6.0).rgb * 0.5
      + textureLod(photo, clamp(here, vec2(0.1), vec2(0.9)), 8.0).rgb * 0.5;
    encoded = toEncoded(around * mix(0.34, 0.12, smoothstep(0.0, 0.6, far)))
      + (noise(gl_FragCoord.xy) - 0.5) / 255.0;
    if (all(greaterThanEqual(here, vec2(0.0))) && all(lessThan(here, vec2(1.0))))
      encoded = toEncoded(texture(photo, here + texture(flow, here).xy).rgb);
  }
  color = vec4(encoded, 1.0);
}`;var B=256;async function q(s){let{atlases:e,keys:t}=s.description,r=["neutral",...t.map(n=>n.name),"gaze","mouths","masks","coverage","hair","photo"].filter(n=>Object.hasOwn(e,n)),i=await Promise.all(r.map(n=>fe(s,e[n])));return Object.fromEntries(r.map((n,c)=>[n,i[c]]))}var z=class{constructor(e,t,o,r){this.gl=e;let i=e.getParameter(e.MAX_TEXTURE_SIZE);for(let[n,c]of Object.entries(o))if(Math.max(c.width,c.height)>i)throw new v(`${n}: ${c.width} x ${c.height} texels, this device takes ${i}; bake with --preset mobile`);e.pixelStorei(e.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),e.pixelStorei(e.UNPACK_COLORSPACE_CONVERSION_WEBGL,e.NONE),e.pixelStorei(e.UNPACK_FLIP_Y_WEBGL,!1),this.side=o.neutral.width,this.faces=this.#e(["neutral",...t.keys.map(n=>n.name)].map(n=>o[n])),this.mouths=this.#t(o.mouths,e.RGBA8),this.gaze=this.#t(o.gaze,e.RGBA8),this.coverage=this.#t(o.coverage??Z(255),e.RGBA8,!0),this.hairy=!!o.hair,this.hair=this.#t(o.hair??Z(0),e.SRGB8_ALPHA8,!0,this.hairy),this.photo=this.#t(o.photo??Z(0),e.SRGB8_ALPHA8,!0,!!o.photo),this.masks=this.#r(o.masks,t.atlases.masks),this.#o(r)}#e(e){let{gl:t,side:o}=this,r=S(t,{format:t.SRGB8_ALPHA8,width:o,height:o,layers:e.length});return e.forEach((i,n)=>{if(i.width!==o||i.height!==o)throw new v("face pictures differ in size; bake the bundle again");t.texSubImage3D(t.TEXTURE_2D_ARRAY,0,0,0,n,o,o,1,t.RGBA,t.UNSIGNED_BYTE,i)}),r}#t(e,t,o=!1,r=!1){let{gl:i}=this,n=i.createTexture();i.bindTexture(i.TEXTURE_2D,n);let{width:c,height:a}=e,l=r?Math.floor(Math.log2(Math.max(c,a)))+1:1;i.texStorage2D(i.TEXTURE_2D,l,t,c,a),e.data?i.texSubImage2D(i.TEXTURE_2D,0,0,0,c,a,i.RGBA,i.UNSIGNED_BYTE,e.data):i.texSubImage2D(i.TEXTURE_2D,0,0,0,i.RGBA,i.UNSIGNED_BYTE,e),r&&i.generateMipmap(i.TEXTURE_2D);let h=o?i.LINEAR:i.NEAREST;return i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MIN_FILTER,r?i.LINEAR_MIPMAP_LINEAR:h),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MAG_FILTER,h),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_WRAP_S,i.CLAMP_TO_EDGE),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_WRAP_T,i.CLAMP_TO_EDGE),n}#r(e,t){let{gl:o}=this,r=e.width/t.columns,i=Math.ceil(y/4),n=this.#t(e,o.RGBA8),c=S(o,{format:o.RGBA8,width:r,height:r,layers:i,linear:!0}),a=new b(o,U,ve),l=o.createFramebuffer();o.bindFramebuffer(o.FRAMEBUFFER,l),o.viewport(0,0,r,r),o.disable(o.DEPTH_TEST),o.disable(o.BLEND),o.disable(o.CULL_FACE),a.use(),a.textures({atlas:[o.TEXTURE_2D,n]}),o.uniform1i(a.at("columns"),t.columns),o.uniform1i(a.at("count"),y),o.uniform1i(a.at("side"),r);for(let h=0;h<i;h++)o.framebufferTextureLayer(o.FRAMEBUFFER,o.COLOR_ATTACHMENT0,c,0,h),o.uniform1i(a.at("first"),4*h),o.drawArrays(o.TRIANGLES,0,3);return o.bindFramebuffer(o.FRAMEBUFFER,null),o.deleteFramebuffer(l),o.deleteTexture(n),o.deleteProgram(a.handle),this.maskSide=r,c}#o(e){let{gl:t}=this,o=e.part.length;this.array=t.createVertexArray(),t.bindVertexArray(this.array);let r=(l,h,p,f,d)=>{t.bindBuffer(t.ARRAY_BUFFER,t.createBuffer()),t.bufferData(t.ARRAY_BUFFER,h,t.STATIC_DRAW),t.enableVertexAttribArray(l),f===t.UNSIGNED_BYTE?t.vertexAttribIPointer(l,p,f,0,0):t.vertexAttribPointer(l,p,f,d,0,0)};r(0,e.positions,3,t.FLOAT,!1),r(1,e.normals,4,t.BYTE,!0),r(2,e.uv,2,t.FLOAT,!1),r(3,e.part,1,t.UNSIGNED_BYTE,!1),t.bindBuffer(t.ELEMENT_ARRAY_BUFFER,t.createBuffer()),t.bufferData(t.ELEMENT_ARRAY_BUFFER,e.indices,t.STATIC_DRAW),t.bindVertexArray(null);let i=Math.ceil(o/B);this.shapes=S(t,{format:t.RGBA16I,width:B,height:i,layers:y});let n=new Int16Array(4*B*i);for(let l=0;l<y;l++)n.set(e.shapes.subarray(4*l*o,4*(l+1)*o)),t.texSubImage3D(t.TEXTURE_2D_ARRAY,0,0,0,l,B,i,1,t.RGBA_INTEGER,t.SHORT,n);this.step=e.reach/32767;let c=l=>l.filter(h=>e.ranges[h]).map(h=>e.ranges[h]),a=F.filter(l=>!W.includes(l));this.runs={image:K(c(a.slice(0,5))),geometry:K(c(a.filter(l=>l!=="mouth_sheet"))),cards:this.hairy?K(c(W)):[]}}};function K(s){let e=[];for(let[t,o]of s){let r=e.at(-1);r&&r[0]+r[1]===t?r[1]+=o:e.push([t,o])}return e}var Z=s=>({width:1,height:1,data:new Uint8Array(4).fill(s)});function be(s,e,t,o){let r=s.getExtension("EXT_color_buffer_float")||s.getExtension("EXT_color_buffer_half_float"),i=l=>new k(s,{format:l,width:e,height:e,linear:!0}),n=l=>new k(s,{format:l,width:t,height:t,count:2,linear:!0}),c=r&&{face:i(s.RGBA16F),weights:n(s.RGBA16F)};(!c||!c.face.complete||!c.weights.complete)&&(c={face:i(s.SRGB8_ALPHA8),weights:n(s.RGBA8)});let a=new k(s,{format:s.RGBA8,width:o[0],height:o[1]});return{...c,mouth:a}}var ze=["color","mask","coverage","uv"],Ge=74,Re=.25,Xe=[8,32],He=[.2,.75];function J(s){return{weights:new b(s,U,xe),compose:new b(s,U,Ee),median:new b(s,U,ye),backdrop:new b(s,U,_e),head:new b(s,Ae,Te)}}var G=class{#e;#t;#r;#o;#s;#n=null;#i=null;#a=new Float32Array(416);#c=new Float32Array(100);#f=new Float32Array(104);#h;#l;#m;constructor(e,t,o,r,i){this.#e=e,this.#t=t,this.#r=o,this.#o=i,this.#s=new z(e,t,r,o);let n=c=>{let{columns:a,rows:l}=t.atlases[c];return[r[c].width/a,r[c].height/l]};this.mouthCell=n("mouths"),this.gazeCell=n("gaze"),this.targets=be(e,this.#s.side,this.#s.maskSide,this.mouthCell),this.bottom=o.positions.reduce((c,a,l)=>l%3===1?Math.min(c,a):c,0),this.lips=Ye(o,"mouth_sheet"),this.#h=H(t.photo_camera.rotation),this.#l=Ve(t.light,o,this.#h),this.#m=["Left","Right"].map(c=>t.expressions.indexOf("eyeBlink"+c)),this.stats={drawCalls:0,uniformBytes:0,milliseconds:0,medians:0,compositions:0}}start(){Object.assign(this.stats,{drawCalls:0,uniformBytes:0,medians:0,compositions:0});let e=this.#e;e.disable(e.DEPTH_TEST),e.disable(e.BLEND),e.disable(e.CULL_FACE)}compose(e,t,o){let r=this.#e,{weights:i,compose:n}=this.#o,c=this.#s,{keys:a}=this.#t,l=o&&c.hairy,h=[];this.#a.fill(0);for(let d=0;d<e.length;d++){let u=t?e[d]:0;if(u===0||!a.some(g=>g.weights[d]))continue;let m=d>>2;h.at(-1)!==m&&h.push(m),a.forEach((g,w)=>{this.#a[4*(8*m+w)+(d&3)]=g.weights[d]*u})}this.targets.weights.bind(),i.use(),i.textures({masks:[r.TEXTURE_2D_ARRAY,c.masks]}),r.uniform1i(i.at("groups"),h.length),h.length&&r.uniform1iv(i.at("group"),h),r.uniform4fv(i.at("product"),this.#a),this.#u(4+4*h.length+this.#a.byteLength),this.targets.face.bind(),n.use();let[p,f]=this.targets.weights.textures;n.textures({faces:[r.TEXTURE_2D_ARRAY,c.faces],low:[r.TEXTURE_2D,p],high:[r.TEXTURE_2D,f],hair:[r.TEXTURE_2D,c.hair]}),r.uniform1i(n.at("keys"),h.length?a.length:0),r.uniform1i(n.at("hairy"),Number(l)),this.#u(8),this.stats.compositions++}median(e){let t=this.#e,o=this.#o.median;for(let r=0;r<e.count;r++)this.#c[2*r]=e.index[r],this.#c[2*r+1]=e.weight[r];this.targets.mouth.bind(),o.use(),o.textures({mouths:[t.TEXTURE_2D,this.#s.mouths]}),t.uniform1i(o.at("columns"),this.#t.atlases.mouths.columns),t.uniform1i(o.at("count"),e.count),t.uniform2i(o.at("cell"),this.mouthCell[0],this.mouthCell[1]),t.uniform2fv(o.at("neighbour"),this.#c),this.#u(16+this.#c.byteLength),this.stats.medians++}pull(e){let t=this.#e;this.#n??=new O(this.#t,this.#r);let{columns:o,rows:r}=this.#n;this.#i??=S(t,{format:t.RG16F,width:o,height:r,linear:!0}),t.bindTexture(t.TEXTURE_2D,this.#i);let i=this.#n.at(e);t.texSubImage2D(t.TEXTURE_2D,0,0,0,o,r,t.RG,t.FLOAT,i)}#d(e,t){let[o,r]=[e.rotation,this.#h].map(c=>c.slice(6)),i=Math.min(o[0]*r[0]+o[1]*r[1]+o[2]*r[2],1),n=ke(Xe,Math.acos(i)*180/Math.PI);return this.#m.map(c=>Re+(1-Re)*Math.max(n,ke(He,t[c])))}#p(e){let t=this.#e;for(let[o,r]of e)t.drawElements(t.TRIANGLES,r,t.UNSIGNED_SHORT,2*o),this.stats.drawCalls++}#u(e){this.#e.drawArrays(this.#e.TRIANGLES,0,3),this.stats.drawCalls++,this.stats.uniformBytes+=e}picture(e,{weights:t,gaze:o,options:r,inPhoto:i,shown:n},c){let a=this.#e,l=this.#t,h=this.#s,{backdrop:p,head:f}=this.#o;a.disable(a.BLEND),a.disable(a.CULL_FACE),a.disable(a.DEPTH_TEST);let d=e.focal/l.photo_camera.focal,u=[e.center[0]-l.photo_camera.center[0]*d,e.center[1]-l.photo_camera.center[1]*d,l.photo_camera.width*d,l.photo_camera.height*d],m=i?this.#i:h.hair;p.use(),p.textures({photo:[a.TEXTURE_2D,h.photo],flow:[a.TEXTURE_2D,m]}),a.uniform4fv(p.at("frame"),u),a.uniform2f(p.at("size"),e.width,e.height),a.uniform1i(p.at("inPhoto"),Number(i)),a.uniform1i(p.at("plain"),Number(c&&!i)),a.uniform3fv(p.at("wall"),r.wall),a.uniform3fv(p.at("floorTint"),r.floor),this.#u(56),a.enable(a.DEPTH_TEST),a.clear(a.DEPTH_BUFFER_BIT),a.enable(a.CULL_FACE),c||(a.enable(a.BLEND),a.blendFunc(a.SRC_ALPHA,a.ONE_MINUS_SRC_ALPHA)),f.use(),f.textures({face:[a.TEXTURE_2D,this.targets.face.textures[0]],mouth:[a.TEXTURE_2D,this.targets.mouth.textures[0]],gaze:[a.TEXTURE_2D,h.gaze],coverage:[a.TEXTURE_2D,h.coverage],photo:[a.TEXTURE_2D,h.photo],flow:[a.TEXTURE_2D,m],hair:[a.TEXTURE_2D,h.hair],masks:[a.TEXTURE_2D_ARRAY,h.masks],shapes:[a.TEXTURE_2D_ARRAY,h.shapes]});let g=0;for(let D=0;D<t.length;D++)t[D]!==0&&(this.#f[2*g]=D,this.#f[2*g+++1]=t[D]*h.step);let w=pe(l.gaze,o),T=2*l.eyes.cap,{columns:E}=l.atlases.gaze,[M,_]=this.gazeCell;a.uniformMatrix4fv(f.at("view"),!1,re(e)),a.uniformMatrix4fv(f.at("projection"),!1,se(e)),a.uniform1i(f.at("count"),g),g&&a.uniform2fv(f.at("moving"),this.#f.subarray(0,2*g));let{uv:x}=l;a.uniform4fv(f.at("places"),[...x.eye_cap_left,...x.eye_cap_right,...x.mouth_sheet]),a.uniform2i(f.at("eyeCell"),M/2,_),a.uniform2i(f.at("eyeCorner"),w%E*M,Math.floor(w/E)*_),a.uniform2f(f.at("slide"),(o[0]-l.gaze[w][0])/T,(l.gaze[w][1]-o[1])/T),a.uniform1i(f.at("layer"),ze.indexOf(r.layer)),a.uniform1i(f.at("shown"),n),a.uniform1i(f.at("lit"),Number(r.light&&!i&&!c)),a.uniform1i(f.at("inPhoto"),Number(i)),a.uniform1i(f.at("soft"),+!c),a.uniform1f(f.at("scale"),-e.focal/e.translation[2]),a.uniform3fv(f.at("light"),l.light.flat()),a.uniform3fv(f.at("fresh"),$e(r.light??l.light)),a.uniformMatrix3fv(f.at("photographed"),!0,this.#h),a.uniform1f(f.at("exposure"),this.#l),a.uniform2fv(f.at("cards"),this.#d(e,t)),a.uniform1f(f.at("lips"),this.lips),a.uniform1i(f.at("geometry"),+(r.mouth==="geometry")),a.uniform2f(f.at("fade"),this.bottom+2,this.bottom+Ge),a.uniform4fv(f.at("frame"),u),a.uniform1f(f.at("tall"),e.height),this.stats.uniformBytes+=128+8*g+48+24+24+256+8+28+8,a.bindVertexArray(h.array),this.#p(r.mouth==="geometry"?h.runs.geometry:h.runs.image),r.layer==="color"&&(a.disable(a.CULL_FACE),a.enable(a.BLEND),a.blendFunc(a.SRC_ALPHA,a.ONE_MINUS_SRC_ALPHA),a.depthMask(!1),this.#p(h.runs.cards),a.depthMask(!0)),a.bindVertexArray(null)}};function ke(s,e){let[t,o]=s,r=Math.min(Math.max((e-t)/(o-t),0),1);return r*r*(3-2*r)}function $e(s){let e=Array.isArray(s)?s.flat():[];if(e.length!==27||!e.every(Number.isFinite))throw new v("options.light: give nine rows of three numbers, or null");return e}function Ve(s,e,t){let o=(a,l,h)=>[.282095,.488603*l,.488603*h,.488603*a,1.092548*a*l,1.092548*l*h,.315392*(3*h*h-1),1.092548*a*h,.546274*(a*a-l*l)].reduce((f,d,u)=>f+d*(.2126*s[u][0]+.7152*s[u][1]+.0722*s[u][2]),0),r=Math.max(o(0,0,1),1e-4),i=F.indexOf("skin"),n=0,c=0;for(let a=0;a<e.part.length;a++){let l=[0,1,2].map(d=>e.normals[4*a+d]/127),[h,p,f]=[0,3,6].map(d=>t[d]*l[0]+t[d+1]*l[1]+t[d+2]*l[2]);e.part[a]!==i||f<.3||(n+=1/Math.min(Math.max(o(h,p,f)/r,.45),1.5),c++)}return c?c/n:1}function Ye(s,e){let[t,o]=s.ranges[e],r=0;for(let i=t;i<t+o;i++)r+=s.positions[3*s.indices[i]+2];return r/o}var je=-40,We=[0,-75,-45],Dt=[32,24],Fe=[35,30];async function St(s,{canvas:e,antialias:t=!0}){let o=e.getContext("webgl2",{antialias:t,alpha:!1,powerPreference:"high-performance"});if(!o)throw new v("this browser has no WebGL 2; update it, or turn hardware acceleration on");let r=typeof s=="string"?await ce(s):s;he(r.description);let i=J(o),[n,c]=await Promise.all([q(r),r.file(V(r.description))]);return new Q(o,r,n,me(c),i)}var Q=class{#e;#t;#r;#o;#s=!1;#n=!0;#i=!0;#a="";constructor(e,t,o,r,i){this.#e=e,this.#t=t,this.#r=r;let n=t.description;this.about=n,this.expressions=n.expressions,this.canvas=e.canvas,this.weights=new Float32Array(n.expressions.length),this.index=new Map(n.expressions.map((c,a)=>[c,a])),this.hasPhoto=!!n.atlases.photo,this.hasHair=!!n.atlases.hair,this.options={stage:"studio",dynamic:!0,hair:!0,mouth:"image",light:null,layer:"color",layerExpression:"jawOpen",wall:[.36,.37,.39],floor:[.13,.135,.15]},this.orbit={yaw:0,pitch:0,zoom:1,shift:[0,0]},this.head=[0,0,0],this.direction=null,this.mouths=new C(n.mouths,n.lips),this.#c(o,i),this.canvas.addEventListener("webglcontextlost",c=>{c.preventDefault(),this.#s=!0}),this.canvas.addEventListener("webglcontextrestored",()=>this.#f())}#c(e,t){this.#o=new G(this.#e,this.about,this.#r,e,t),this.stats=this.#o.stats,Object.values(e).forEach(o=>o.close()),this.mouths.weight.fill(-1),this.#n=this.#i=!0}async#f(){let e=J(this.#e);this.#c(await q(this.#t),e),this.#s=!1,this.canvas.dispatchEvent(new Event("avatarrestored"))}set(e){for(let[t,o]of Object.entries(e)){let r=this.index.get(t);if(r===void 0)throw new v(`no expression '${String(t).slice(0,40)}'`);if(!Number.isFinite(o))throw new v(`${t}: ${o} is no weight`);let i=Math.fround(Math.min(Math.max(o,0),1));this.weights[r]!==i&&(this.weights[r]=i,t.startsWith("eyeLook")&&(this.direction=null),this.#n=this.#i=!0)}return this}get(e){return this.weights[this.index.get(e)]}reset(){return this.weights.fill(0),this.direction=null,this.head=[0,0,0],this.#n=this.#i=!0,this}look(e,t){if(!Number.isFinite(e+t))throw new v("gaze is no number");let[o,r]=this.about.eyes.degrees;for(let[i,n]of[["Left",1],["Right",-1]])this.set({["eyeLookOut"+i]:Number(n)*e/o,["eyeLookIn"+i]:-Number(n)*e/o,["eyeLookUp"+i]:t/r,["eyeLookDown"+i]:-t/r});return this.direction=[e,t],this}get gaze(){if(this.direction)return this.direction.map((n,c)=>Math.min(Math.max(n,-Fe[c]),Fe[c]));let[e,t]=this.about.eyes.degrees,o=n=>this.get(n),r=o("eyeLookOutLeft")-o("eyeLookInLeft")-o("eyeLookOutRight")+o("eyeLookInRight"),i=o("eyeLookUpLeft")-o("eyeLookDownLeft")+o("eyeLookUpRight")-o("eyeLookDownRight");return[e*r/2,t*i/2]}turn(e,t,o=0){if(!Number.isFinite(e+t+o))throw new v("a head turn is no number");return this.head=[e,t,o],this}get inPhoto(){return this.options.stage==="photo"&&this.hasPhoto}view(e=this.canvas.width,t=this.canvas.height){let{about:o,orbit:r}=this,i=r.shift.map(h=>h*t);if(this.inPhoto){let{width:h,height:p}=o.photo_camera,f=Math.min(e/h,t/p)*r.zoom;return I(P(o.photo_camera),[h/2,p/2],f,e,t,i)}let n=P(o.front_camera),c=.74*Math.min(e*1.12,t)*r.zoom/n.width,a=[n.width/2,n.height*.5],l=ee(I(n,a,c,e,t,i),r.yaw,r.pitch,[0,o.pivot[1],je]);return this.head.some(Boolean)?te(l,$(...this.head),We):l}frontView(e){let t=P(this.about.front_camera);return I(t,[t.width/2,t.height/2],e/t.width,e,e)}eyes(){let e=this.view();return this.about.eyes.centers.map(([t,o,r])=>{let[i,n,c]=oe(e,[t,o,r+11]);return[i,n,13*e.focal/c]})}render(){if(this.#s)return;let e=performance.now();this.#l();let t=this.#e;t.bindFramebuffer(t.FRAMEBUFFER,null),t.viewport(0,0,this.canvas.width,this.canvas.height),this.#o.picture(this.view(),this.#h(),!1),this.stats.milliseconds=performance.now()-e}capture({width:e,height:t,view:o=this.view(e,t)}){let r=this.#e;this.#l();let i=new k(r,{format:r.RGBA8,width:e,height:t,depth:!0});i.bind(),this.#o.picture(o,this.#h(),!0);let n=Me(r,e,t);return i.dispose(),Ke(n,e,t)}mouthSheet(){this.#l();let{mouth:e}=this.#o.targets;return e.bind(),{width:e.width,height:e.height,data:Me(this.#e,e.width,e.height)}}#h(){let{weights:e,gaze:t,options:o,inPhoto:r}=this;return{weights:e,gaze:t,options:o,inPhoto:r,shown:this.index.get(o.layerExpression)??0}}#l(){let e=this.#o,{dynamic:t,hair:o}=this.options;e.start();let r=`${t} ${o}`;(this.#n||r!==this.#a)&&(e.compose(this.weights,t,o),this.mouths.find(this.weights)&&e.median(this.mouths),this.#n=!1,this.#a=r),this.inPhoto&&this.#i&&(e.pull(this.weights),this.#i=!1)}dispose(){this.#e.getExtension("WEBGL_lose_context")?.loseContext()}};function Me(s,e,t){let o=new Uint8Array(4*e*t);return s.pixelStorei(s.PACK_ALIGNMENT,1),s.readPixels(0,0,e,t,s.RGBA,s.UNSIGNED_BYTE,o),s.bindFramebuffer(s.FRAMEBUFFER,null),o}function Ke(s,e,t){let o=new Uint8Array(s.length);for(let r=0;r<t;r++)o.set(s.subarray(4*e*r,4*e*(r+1)),4*e*(t-1-r));return o}export{Q as Avatar,v as AvatarError,Dt as MOST_GAZE,j as decodeIndices,Y as decodeVertices,St as load,me as parseHead};
